"""Finding the program, and what becomes of its failures."""

import os
import signal
import subprocess
import sys
import textwrap
import time

import pytest

import skiagraph
from skiagraph import executable

VERSION = subprocess.run([skiagraph.program(), "--version"], capture_output=True, text=True).stdout.split()[-1]


def fake(folder, script):
    """A program that answers --version as ours does, and then runs a shell script."""
    path = folder / "skiagraph"
    path.write_text(f'#!/bin/sh\n[ "$1" = --version ] && echo skiagraph {VERSION} && exit\n{script}\n')
    path.chmod(0o755)
    return str(path)


def test_a_missing_program_is_named_and_so_is_the_remedy(monkeypatch, tmp_path):
    monkeypatch.setenv("SKIAGRAPH", str(tmp_path / "gone"))
    with pytest.raises(skiagraph.ProgramError, match=r"gone, which is no program"):
        skiagraph.program()
    monkeypatch.setattr(executable.sysconfig, "get_path", lambda *_: str(tmp_path))
    monkeypatch.setattr(executable, "__file__", str(tmp_path / "package/executable.py"))
    with pytest.raises(skiagraph.ProgramError, match=r"neither in the environment .* nor on the PATH; install"):
        executable._find(None, str(tmp_path))


def test_a_program_may_be_named_as_in_a_shell(monkeypatch, tmp_path):
    path = fake(tmp_path, "")
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    for named in ("skiagraph", path):
        monkeypatch.setenv("SKIAGRAPH", named)
        assert str(skiagraph.program()) == path


def test_a_program_of_another_version_is_refused_before_anything_is_done(monkeypatch, tmp_path):
    monkeypatch.setenv("SKIAGRAPH", fake(tmp_path, "touch done"))
    monkeypatch.setattr(executable, "package_version", lambda: "9.9.9")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(skiagraph.ProgramError, match=rf"is version {VERSION}, but this package is version 9\.9\.9"):
        skiagraph.render("walk", tmp_path / "set")
    assert not (tmp_path / "done").exists()


def test_a_program_that_cannot_be_started_is_reported(monkeypatch, tmp_path):
    path = tmp_path / "skiagraph"
    path.write_text("#!/no/such/interpreter\n")
    path.chmod(0o755)
    monkeypatch.setenv("SKIAGRAPH", str(path))
    with pytest.raises(skiagraph.ProgramError, match="cannot start"):
        skiagraph.program()


def test_a_killed_program_is_reported_with_its_signal(monkeypatch, tmp_path):
    monkeypatch.setenv("SKIAGRAPH", fake(tmp_path, "kill -9 $$"))
    with pytest.raises(skiagraph.ProgramError, match="killed by signal 9"):
        skiagraph.render("walk", tmp_path / "set")


@pytest.mark.parametrize(("code", "kind"), [(2, skiagraph.InputError), (75, skiagraph.SkiagraphError)])
def test_the_message_of_the_program_is_that_of_the_exception(monkeypatch, tmp_path, code, kind):
    monkeypatch.setenv("SKIAGRAPH", fake(tmp_path, f"echo error: disk is full >&2; exit {code}"))
    with pytest.raises(kind, match=r"^disk is full$") as raised:
        skiagraph.render("walk", tmp_path / "set")
    assert raised.value.exit_code == code


def test_a_wrong_setting_is_an_input_error_with_a_suggestion(tmp_path):
    with pytest.raises(ValueError, match="did you mean `particles`"):
        skiagraph.render("walk", tmp_path / "set", particels=3)
    with pytest.raises(skiagraph.InputError, match="particles: expected a number, text, list or dictionary, found set"):
        skiagraph.render("walk", tmp_path / "set", particles={3})


def test_an_error_has_its_kind_and_fields(small, tmp_path):
    with pytest.raises(skiagraph.InputError) as raised:
        skiagraph.render("walk", tmp_path / "set", particles=0)
    fields = raised.value.fields
    assert (fields["kind"], fields["key"]) == ("scenario", "tracker.annealed_particle_filter.particles")
    with pytest.raises(skiagraph.InputError) as raised:
        skiagraph.render("walk", small.path)
    assert raised.value.fields["kind"] == "occupied"
    assert raised.value.fields["path"] == str(small.path)


def test_nothing_is_printed_unless_asked(small, tmp_path, capfd):
    run = skiagraph.track(small, lambda frame: frame.info.start.markers)
    run.evaluate()
    skiagraph.render("walk", tmp_path / "set", loop_to_s=0.5, size_px=[64, 48])
    assert capfd.readouterr() == ("", "")
    skiagraph.track(small, lambda frame: frame.info.start.markers, progress=True)
    assert "100 %" in capfd.readouterr().err


def test_importing_loads_neither_pandas_nor_other_large_packages():
    heavy = "pandas matplotlib pytest tarfile importlib.metadata asyncio"
    code = f"import sys, skiagraph; print(set('{heavy}'.split()) & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout == "set()\n"


def interrupted(code, folder, when):
    """Runs Python code in a process group of its own, interrupts it as soon as a file is there, and returns what it
    said and how long it took to end.
    """
    child = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(code)],
        cwd=folder,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    while not list(folder.glob(when)):
        assert child.poll() is None
        time.sleep(0.05)
    begun = time.monotonic()
    os.killpg(child.pid, signal.SIGINT)
    said = child.communicate(timeout=20)[1]
    return said, time.monotonic() - begun


@pytest.mark.skipif(sys.platform == "win32", reason="signals of process groups")
def test_ctrl_c_ends_a_rendering_which_the_same_call_resumes(tmp_path):
    code = "import skiagraph; skiagraph.render('walk', 'set', loop_to_s=60.0)"
    said, took = interrupted(code, tmp_path, "set.partial/set/observations/*/*/*.png")
    assert said.rstrip().endswith("KeyboardInterrupt")
    assert took < 5
    assert (tmp_path / "set.partial").exists()
    assert not (tmp_path / "set").exists()


@pytest.mark.skipif(sys.platform == "win32", reason="signals of process groups")
def test_ctrl_c_in_a_tracker_ends_the_program_too(small, tmp_path):
    code = f"""
    import skiagraph, time
    def slow(frame):
        open("tracking", "w").close()
        time.sleep(0.2)
        return frame.info.start.markers
    skiagraph.track({str(small.path)!r}, slow, seeds=100, out="run")
    """
    said, took = interrupted(code, tmp_path, "tracking")
    assert said.rstrip().endswith("KeyboardInterrupt")
    assert took < 5
    assert not (tmp_path / "run").exists()
