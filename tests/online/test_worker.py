"""A stage in a process of its own: orders, events, errors, death."""

import importlib
import os
import signal
import time

import pytest

from zfcal.errors import ZfcalError
from zfcal.online.worker import Done, Failure, Worker
from zfcal.stages.events import Note

JOB = """
import logging, os, time
from zfcal.errors import DamagedError, InputError, LockedError
from zfcal.stages.events import Note

def job(order, tell):
    if order == "error":
        raise InputError("It is wrong.", hint="Mend it.")
    if order == "locked":
        raise LockedError("It is locked.")
    if order == "damaged":
        raise DamagedError("It is damaged.")
    if order == "log":
        logging.getLogger("zfcal.model").info("It compiles.")
    if order == "sleep":
        time.sleep(60)
    if order == "nice":
        return os.nice(0)
    if order == "bug":
        raise ZeroDivisionError
    tell(Note(text=f"hears {order}"))
    return order
"""
"""Does as it is told; in a module that another process finds by its name."""


@pytest.fixture
def worker(tmp_path, monkeypatch):
    """Return a worker that is ended after the test."""
    (tmp_path / "told_job.py").write_text(JOB)
    monkeypatch.syspath_prepend(tmp_path)
    made = Worker("test", importlib.import_module("told_job").job, niceness=3)
    yield made
    made.stop()


def answer(worker, order):
    """Give an order and return all that comes until the answer."""
    worker.order(order)
    assert worker.is_busy
    told, ends_s = [], time.monotonic() + 20
    while worker.is_busy:
        assert time.monotonic() < ends_s
        told += worker.take()
        time.sleep(0.01)
    return told


def test_orders_are_carried_out_one_after_the_other(worker):
    """What a job tells comes before its answer; what the library logs comes as notes."""
    assert answer(worker, 1) == [Note(text="hears 1"), Done(result=1)]
    assert answer(worker, "log")[0] == Note(text="It compiles.")
    assert worker.take() == []


def test_errors_come_with_hint_and_code_and_the_process_lives_on(worker):
    """A person can mend them; the next order is carried out."""
    process = worker.process
    (wrong,) = answer(worker, "error")
    assert wrong == Failure(message="It is wrong.", hint="Mend it.", exit_code=1)
    assert answer(worker, "locked")[0].exit_code == 75
    assert answer(worker, 2)[-1] == Done(result=2)
    assert worker.process == process


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_a_process_that_dies_is_a_failure_without_a_code(worker, number):
    """Also when it has nothing to do; orders to it fall on deaf ears."""
    answer(worker, 1)
    worker.order("sleep")
    os.kill(worker.process, number)
    ends_s = time.monotonic() + 20
    while worker.is_busy:
        assert time.monotonic() < ends_s
        told = worker.take()
        time.sleep(0.01)
    assert told[-1].exit_code is None
    assert "process of test ended" in told[-1].message
    worker.order("more")
    assert worker.take()[-1].exit_code is None


def test_a_bug_ends_the_process_and_is_a_failure(worker):
    """Its traceback goes to standard error; the watch starts the stage anew."""
    assert answer(worker, "bug")[-1].exit_code is None


def test_an_answer_can_be_waited_for(worker):
    """What was told before it is passed on; without an order there is nothing to wait for."""
    heard = []
    assert worker.answer(heard.append) is None
    worker.order("this")
    assert worker.answer(heard.append) == "this"
    assert heard == [Note(text="hears this")]
    assert not worker.is_busy


def test_errors_are_raised_for_who_waits(worker):
    """With hint and exit code; so is a death. The process that lives carries on."""
    worker.order("error")
    with pytest.raises(ZfcalError, match="It is wrong") as caught:
        worker.answer(print)
    assert caught.value.hint == "Mend it."
    for order, code in (("locked", 75), ("damaged", 3)):
        worker.order(order)
        with pytest.raises(ZfcalError) as caught:
            worker.answer(print)
        assert caught.value.exit_code == code
    worker.order("still there")
    assert worker.answer(print) == "still there"
    worker.order("sleep")
    os.kill(worker.process, signal.SIGKILL)
    with pytest.raises(ZfcalError, match="process of test ended"):
        worker.answer(print)


def test_its_priority_is_lowered(worker):
    """By as much as it was asked for, as far as the system has lower ones."""
    assert answer(worker, "nice")[-1] == Done(result=min(os.nice(0) + 3, 19))


def test_it_is_stopped_in_the_middle_of_its_work(worker):
    """At once, and again without harm."""
    answer(worker, 1)
    worker.order("sleep")
    began_s = time.monotonic()
    worker.stop()
    assert time.monotonic() - began_s < 5
    with pytest.raises(ProcessLookupError):
        os.kill(worker.process, 0)


def test_it_is_stopped_while_it_prepares_itself(tmp_path, monkeypatch, capfd):
    """SIGTERM may come before the first order is waited for: no traceback, whatever the moment."""
    module = "import os, signal\nos.nice = lambda by: os.kill(os.getpid(), signal.SIGTERM)\n"
    (tmp_path / "early_job.py").write_text(module + "def job(order, tell): ...\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(os, "nice", os.nice)
    made = Worker("test", importlib.import_module("early_job").job)
    made.order(1)
    ends_s = time.monotonic() + 20
    while made.is_busy and time.monotonic() < ends_s:
        made.take()
        time.sleep(0.01)
    assert not made.is_busy
    made.stop()
    assert "Traceback" not in capfd.readouterr().err
