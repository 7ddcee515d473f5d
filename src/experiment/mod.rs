//! Scenarios and what is done with them: the only room that knows every other.
