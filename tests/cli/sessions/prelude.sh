# What every step of a session begins with.
exec 2>&1

# The program; a line `? CODE` follows what it says if it does not succeed.
skiagraph() { "$PROGRAM" "$@" 2>&1 || echo "? $?"; }

# Edits a file: edit FILE SED...
edit() {
    edited=$1
    shift
    sed "$@" "$edited" >.edited && cat .edited >"$edited" && rm .edited
}

# Makes the list of hashes of a set again, as if it had been written like this.
sign() { (cd "$1" && find * -type f ! -name files.sha256 | LC_ALL=C sort | xargs sha256sum >files.sha256); }

# TEXT COUNT times.
repeated() { awk -v text="$1" -v count="$2" 'BEGIN { while (count-- > 0) printf "%s", text }'; }
