#!/usr/bin/env python3
"""omentum rl play on a terminal: single keys act at once, and the terminal is restored however the program ends.

    test_play_terminal.py PROGRAM
"""
import fcntl
import os
import select
import signal
import subprocess
import sys
import termios
import time

SINGLE = termios.ICANON | termios.ECHO


class Player:
    """The program with a terminal of its own."""

    def __init__(self, *words):
        self.master, self.slave = os.openpty()
        self.before = termios.tcgetattr(self.slave)
        self.text = ""

        def take_terminal():
            os.setsid()
            fcntl.ioctl(0, termios.TIOCSCTTY, 0)

        self.run = subprocess.Popen([sys.argv[1], "rl", "play", *words], stdin=self.slave, stdout=self.slave,
                                    stderr=self.slave, preexec_fn=take_terminal)

    def wait(self, is_there, what):
        """Read what is printed until a condition holds."""
        end = time.monotonic() + 100
        while not is_there():
            if time.monotonic() > end:
                sys.exit(f"no {what} after 100 s; printed:\n{self.text}")
            if select.select([self.master], [], [], 0.05)[0]:
                self.text += os.read(self.master, 4096).decode()

    def wait_text(self, text):
        self.wait(lambda: text in self.text, repr(text))

    def type(self, keys):
        os.write(self.master, keys.encode())

    def is_single(self):
        return termios.tcgetattr(self.slave)[3] & SINGLE == 0

    def end(self, code):
        """Wait for the end: exit code, and the terminal as it was."""
        self.wait(lambda: self.run.poll() is not None, "end")
        while select.select([self.master], [], [], 0)[0]:  # what was printed last; the slave is open here, too
            self.text += os.read(self.master, 4096).decode()
        if self.run.returncode != code:
            sys.exit(f"exit code {self.run.returncode}, not {code}; printed:\n{self.text}")
        after = termios.tcgetattr(self.slave)
        if after != self.before:
            sys.exit(f"the terminal is not restored: {self.before} became {after}")
        os.close(self.master)
        os.close(self.slave)


def main():
    signal.signal(signal.SIGHUP, signal.SIG_DFL)  # under nohup it is ignored, by the program as well
    # keys act one by one, without a line end; an unknown one changes nothing
    p = Player("-t", "reach", "--start", "0")
    p.wait_text("0 steps")
    assert p.is_single()
    p.type("w")
    p.wait_text("1 steps")
    p.type("\x1b[A")
    p.wait_text("2 steps")
    p.type("z")
    p.wait_text("no such key")
    p.type("3e")
    p.wait_text("5 steps")
    p.type("?")
    p.wait_text("up (+z): page up, o, e")
    p.type("q")
    p.end(0)
    assert "episode 1, not finished: 5 steps" in p.text

    # signals
    for number, code in ((signal.SIGTERM, 130), (signal.SIGINT, 130), (signal.SIGHUP, 130),
                         (signal.SIGQUIT, -signal.SIGQUIT), (signal.SIGABRT, -signal.SIGABRT)):
        p = Player("-t", "cart-pole")
        p.wait_text("q ends")
        p.wait(p.is_single, "single keys")
        p.run.send_signal(number)
        p.end(code)
    p = Player("-t", "cart-pole")
    p.wait_text("q ends")
    p.wait(p.is_single, "single keys")
    p.type("\x03")  # Ctrl-C
    p.end(130)

    # stopped and continued
    p = Player("-t", "reach")
    p.wait_text("q ends")
    p.wait(p.is_single, "single keys")
    p.run.send_signal(signal.SIGTSTP)
    p.wait(lambda: not p.is_single(), "lines while it is stopped")
    p.run.send_signal(signal.SIGCONT)
    p.wait(p.is_single, "single keys again")
    p.type("wq")
    p.end(0)
    assert "not finished: 1 steps" in p.text

    # the clock moves the world without a key, and a key acts
    p = Player("-t", "reach", "--start", "0", "--real-time", "--rate", "50")
    p.wait_text("4 steps")
    p.type("wde")
    p.wait_text("10 steps")
    p.type("q")
    p.end(0)


if __name__ == "__main__":
    main()
