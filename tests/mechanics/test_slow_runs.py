"""A simulation that takes long says what its steps follow."""

import re

import flexband as fb
from flexband import contact
from flexband.basics import progress
from flexband.mechanics.engine.free_steps.under_way import BlocksUnderWay

LAW = contact.KeepsRestitution(stiffness=1e7, restitution=0.7)


def cable():
    """A stiff cable on a spring, whose end falls on a floor: its waves are fast."""
    return fb.Mechanism(
        bodies={
            "rope": fb.Cable(
                length=1.0, mass_per_length=0.02, axial_stiffness=1e5, bending_stiffness=1e-3,
                elements=8,
            )
        },
        joints={"guide": fb.Slot("rope.start", (0.0, 0.0))},
        loads={
            "g": fb.Gravity(),
            "spring": fb.Spring("rope.start", (-1.0, 0.0), stiffness=100.0, rest_length=1.0),
            "floor": contact.Stop("rope.end", (0.0, -1e-3), LAW, lower=0.0, axis=(0.0, 1.0)),
        },
        sensors={"end": fb.Position("rope.end")},
    )  # fmt: skip


def test_what_the_steps_follow_is_known(monkeypatch):
    texts = []
    finish = BlocksUnderWay.finish

    def note_slowness(blocks, number):
        texts.append(blocks.slowness())
        finish(blocks, number)

    monkeypatch.setattr(BlocksUnderWay, "finish", note_slowness)
    fb.simulate(cable(), duration=0.02, step=1e-3)
    (text,) = texts
    words = r"fast motions of body 'rope'( while 'floor' is closed)?: damping, or fewer elements"
    assert re.match(r"steps of [\d.e-]+ s follow " + words, text)


def test_why_a_run_takes_long_is_told_once(monkeypatch):
    monkeypatch.setattr(progress.Pace, "long", 0.0)
    messages = []
    listener = progress.ProgressListener()
    shares = iter([0.1, 0.2, 0.3, 0.4])
    listener.warn = messages.append
    with progress.add_listener(listener):
        pace = progress.Pace(10, lambda: next(shares), lambda: "steps follow this")
        for _ in range(4):
            pace()
    (message,) = messages
    assert re.fullmatch(r"20 % of runs of 10 steps, about .* left; steps follow this", message)


def test_steps_that_reach_no_time_are_told(monkeypatch):
    monkeypatch.setattr(progress.Pace, "silent", 0.0)
    messages = []
    listener = progress.ProgressListener()
    listener.warn = messages.append
    with progress.add_listener(listener):
        pace = progress.Pace(10, lambda: 0.0, lambda: "steps follow this")
        pace()
        pace()
    (message,) = messages
    assert re.fullmatch(r"no further time is reached after [\d.e-]+ s; steps follow this", message)


def test_short_simulations_say_nothing(capsys):
    for _ in range(2):
        capsys.readouterr()
        fb.simulate(cable(), duration=0.001, step=1e-4)
    assert capsys.readouterr().err == ""
