"""Progress, interruption, and the lock of the interpreter."""

import os
import signal
import subprocess
import sys
import textwrap
import threading
import time

import pytest
from drawing import ellipses

import shapespace


def test_progress_is_told_in_order():
    events = []
    shapespace.average(ellipses(17), grid=17, progress=events.append)
    stages = [event.name for event in events if isinstance(event, shapespace.Stage)]
    assert stages[0] == "reading 3 masks"
    assert any(stage.startswith("level 1 of ") for stage in stages)
    assert any(isinstance(event, shapespace.Iteration) for event in events)
    assert any("memory" in str(event) for event in events)


def test_progress_does_not_change_the_result():
    quiet = shapespace.average(ellipses(17), grid=17, threads=1)
    told = shapespace.average(ellipses(17), grid=17, threads=2, progress=lambda event: None)
    assert quiet.average.tobytes() == told.average.tobytes()


def test_an_exception_of_the_callback_ends_the_computation():
    def fail(event):
        raise KeyError("enough")

    with pytest.raises(KeyError, match="enough"):
        shapespace.average(ellipses(33), progress=fail)


LONG = """
    import shapespace, signal, sys
    from drawing import ellipses
    # A process in the background may have been started without.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    def told(event):
        if isinstance(event, shapespace.Iteration):
            print("running", flush=True)
    try:
        shapespace.average(ellipses(), grid=1025, tolerance=1e-12, progress=told)
    except KeyboardInterrupt:
        print("stopped", flush=True)
        sys.exit(7)
"""


@pytest.mark.skipif(os.name == "nt", reason="signals of this kind are not those of Windows")
def test_ctrl_c_is_heard_at_once():
    process = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(LONG)],
        cwd=os.path.dirname(__file__),
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout.readline() == "running\n"
        process.send_signal(signal.SIGINT)
        output, _ = process.communicate(timeout=60)
    finally:
        process.kill()
    assert output.endswith("stopped\n")
    assert process.returncode == 7


def test_other_threads_of_python_run_in_the_meantime():
    ticks = []
    done = threading.Event()

    def tick():
        while not done.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.001)

    ticker = threading.Thread(target=tick)
    ticker.start()
    begin = time.monotonic()
    shapespace.average(ellipses(33), grid=33)
    seconds = time.monotonic() - begin
    done.set()
    ticker.join()
    # With the lock held there would be at most a few.
    assert len(ticks) > 5 or seconds < 0.02


def test_calls_at_the_same_time_do_not_disturb_each_other():
    expected = shapespace.average(ellipses(17), grid=17).average.tobytes()
    found = []

    def run():
        found.append(shapespace.average(ellipses(17), grid=17, threads=1).average.tobytes())

    threads = [threading.Thread(target=run) for _ in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [expected] * 3


KILLED = """
    import shapespace, os, signal
    from drawing import ellipses
    folder = {folder!r}
    def told(event):
        if isinstance(event, shapespace.Iteration) and os.path.isfile(folder + ".partial/state.json"):
            os.kill(os.getpid(), signal.SIGKILL)
    shapespace.average(ellipses(), grid=65, checkpoint=(folder, 1e-6), progress=told)
"""


@pytest.mark.skipif(os.name == "nt", reason="signals of this kind are not those of Windows")
def test_a_killed_call_resumes_from_its_checkpoint(tmp_path):
    folder = str(tmp_path / "average")
    code = textwrap.dedent(KILLED.format(folder=folder))
    killed = subprocess.run([sys.executable, "-c", code], cwd=os.path.dirname(__file__), check=False)
    assert killed.returncode == -signal.SIGKILL
    assert os.path.isdir(folder + ".partial")
    events = []
    options = {"grid": 65}
    resumed = shapespace.average(
        ellipses(), checkpoint=(folder, 10), progress=events.append, **options
    )
    assert any("checkpoint" in str(event) or "resum" in str(event) for event in events)
    assert not os.path.exists(folder + ".partial")
    whole = shapespace.average(ellipses(), **options)
    assert resumed.average.tobytes() == whole.average.tobytes()
    assert resumed.record["iterations"] == whole.record["iterations"]


def test_checkpoints_need_minutes():
    with pytest.raises(shapespace.InputError, match="checkpoint"):
        shapespace.average(ellipses(17), grid=17, checkpoint=("folder", 0))


def test_an_exception_of_the_callback_ends_a_verification():
    def fail(event):
        raise KeyError("enough")

    with pytest.raises(KeyError, match="enough"):
        shapespace.verify("laws", quick=True, threads=1, progress=fail)
