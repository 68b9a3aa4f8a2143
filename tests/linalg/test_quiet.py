"""What compiled code prints."""

import ctypes
import sys
import threading

import pytest

from unassemble.linalg import quiet


@pytest.mark.skipif(sys.platform == "win32", reason="the C library goes by another name")
def test_only_what_compiled_code_prints_is_lost(capfd):
    library = ctypes.CDLL(None)
    sys.stdout.write("before\n")
    with quiet():
        library.printf(b"noise\n")
    sys.stdout.write("after\n")
    library.printf(b"wanted\n")
    library.fflush(None)
    assert capfd.readouterr().out.split() == ["before", "after", "wanted"]


@pytest.mark.skipif(sys.platform == "win32", reason="the C library goes by another name")
def test_threads_take_turns(capfd):
    first, second = threading.Event(), threading.Event()

    def hold():
        with quiet():
            first.set()
            second.wait(0.2)

    one, other = (threading.Thread(target=hold) for _ in range(2))
    one.start()
    first.wait()
    other.start()
    one.join()
    other.join()
    sys.stdout.write("wanted\n")
    assert capfd.readouterr().out == "wanted\n"
