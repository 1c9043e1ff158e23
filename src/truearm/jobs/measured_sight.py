"""How much of a plan a virtual instrument can read, counted before anything is measured."""

from __future__ import annotations

import numpy as np

from truearm.errors import InputError, Words
from truearm.measurement.measuring.session import Session
from truearm.modeling.chain import Array
from truearm.modeling.robot import Robot
from truearm.notices import Notice
from truearm.shown import counted
from truearm.simulation.devices.device import Device


def sight_notices(session: Session, device: Device, placed: Robot, joints: Array) -> tuple[Notice, ...]:
    """Return what to know where a device cannot read all targets that are asked for.

    Args:
        placed: The nominal robot where the device sees it.
        joints: Of the plan, as the model counts them [rad or m], ``(n, joints)``.

    Raises:
        InputError: If it can read none of them at any configuration: a log of missed readings would be all that comes
            of it.
    """
    asked = np.array([[target.name in names for target in placed.targets] for names in session.asked])
    seen = asked & device.visible(placed, joints)
    of_pairs = f"of {counted(int(asked.sum()), 'pair')} of configuration and target"
    cure = f"`truearm plan` with `device={device.name}`, on the page Plan of the studio the field Instrument"
    if not seen.any():
        raise InputError(
            f"nothing of this plan can be read with the {device.name}: {device.reads_where}",
            parameter="plan",
            came=Words(f"0 {of_pairs} at which that is so"),
            cure=f"Plan with the instrument: {cure}.",
        )
    if (seen == asked).all():
        return ()
    blind = int((asked.any(axis=1) & ~seen.any(axis=1)).sum())
    nothing = f"none at {blind} of {counted(len(joints), 'configuration')}" if blind else "some at every configuration"
    return (
        Notice(
            "not-seen",
            f"With the {device.name} {seen.sum()} {of_pairs} can be read, {nothing}: {device.reads_where}. The others "
            f"are left out. A plan that is made with the instrument asks for what it sees: {cure}.",
            "warning" if blind else "note",
        ),
    )
