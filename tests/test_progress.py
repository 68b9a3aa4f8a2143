from __future__ import annotations

import io
import time

import pytest

from unassemble.progress import StageDisplay


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_long_work_shows_its_stage_and_leaves_no_trace():
    terminal = Terminal()
    with StageDisplay(terminal, delay=0.02, interval=0.01) as display:
        display("polish")
        time.sleep(0.3)
        display("something new")
        time.sleep(0.3)
    text = terminal.getvalue()
    assert "polishing, 00:00" in text
    assert "something new" in text
    assert text.endswith("\r")  # the line is wiped


def test_short_work_shows_nothing():
    terminal = Terminal()
    with StageDisplay(terminal, delay=30) as display:
        display("polish")
    assert terminal.getvalue() == ""


@pytest.mark.parametrize(("stream", "enabled"), [(io.StringIO(), True), (Terminal(), False)])
def test_nothing_where_nobody_looks(stream, enabled):
    with StageDisplay(stream, enabled=enabled, delay=0) as display:
        display("polish")
        time.sleep(0.05)
    assert stream.getvalue() == ""


def test_errors_pass_through_and_the_line_goes():
    terminal = Terminal()

    def work():
        with StageDisplay(terminal, delay=0, interval=0.01):
            time.sleep(0.2)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        work()
    assert terminal.getvalue().endswith("\r")
