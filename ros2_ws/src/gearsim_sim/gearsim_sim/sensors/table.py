"""From the `sensors` section of a scenario to the sensor table of a machine."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

from gearsim_io.errors import InputError
from gearsim_io.nameplate import Channel, Machine
from gearsim_sim.frf.sites import through_responses
from gearsim_sim.sensors.marks import Pickup
from gearsim_sim.sensors.rows import Encoder, Row, SensorTable, Tacho
from gearsim_sim.sensors.settings import (
    AccelerometersModel,
    Effects,
    EncodersModel,
    SensorsModel,
    SignalPath,
    TachosModel,
    TorquesModel,
    chain,
    chain_names,
)


def torque_signal(shaft: str) -> str:
    """Name under which a model gives the torque in a shaft, and of its channel."""
    return f"{shaft}_torque"


def sensor_table(model: SensorsModel, machine: Machine, where: str) -> SensorTable:
    """The table that a scenario's `sensors` section means for a machine.

    Raises
    ------
    InputError
        An unknown chain, channel or shaft, or a word length without a range; named as in file `where`.
    """
    tachos, encoders = model.tachos, model.encoders
    tacho_shafts = _shafts(tachos.shafts, machine.tacho_shafts, machine, f"{where}: sensors.tachos")
    encoder_shafts = _shafts(encoders.shafts, machine.encoder_shafts, machine, f"{where}: sensors.encoders")
    _check_each(tachos.each, tacho_shafts, f"{where}: sensors.tachos")
    _check_each(encoders.each, encoder_shafts, f"{where}: sensors.encoders")
    return SensorTable(
        accelerometers=_accelerometers(model.accelerometers, machine, where),
        tachos=tuple(Tacho(shaft, tachos.pulses, pickup=_pickup(tachos, shaft)) for shaft in tacho_shafts),
        encoders=tuple(
            Encoder(shaft, encoders.lines, pickup=_pickup(encoders, shaft)) for shaft in encoder_shafts
        ),
        torques=_torques(model.torques, machine, where),
        sampling=model.accelerometers.sampling,
    )


def _accelerometers(model: AccelerometersModel, machine: Machine, where: str) -> tuple[Row, ...]:
    place = "sensors.accelerometers"
    effects = _chain("accelerometers", model.chain, where)
    known = {channel.name: channel for channel in machine.channels}
    names = tuple(known) if model.channels is None else model.channels
    for name in (*names, *model.each):
        # A channel of one's own is allowed, if it says which site it looks at.
        own = name in model.each and model.each[name].site is not None
        if name not in known and not own:
            expected = "one of " + ", ".join(known) + ", or a site for it under each"
            raise InputError(where, f"{place}.channels", name, expected)
    if len(set(names)) != len(names):
        raise InputError(where, f"{place}.channels", list(names), "each channel once")
    extra = tuple(name for name in model.each if name not in names)
    if extra:
        raise InputError(where, f"{place}.each", extra[0], "a channel that is listed under channels")
    rows = tuple(_row(name, known.get(name), model, effects) for name in names)
    for row in rows:
        _check_row(row, place, where)
    return rows


def _row(name: str, channel: Channel | None, model: AccelerometersModel, effects: Effects) -> Row:
    row = Row(name, name, channel.axis if channel else "")
    row = dataclasses.replace(row, **effects.given())
    if channel is not None and math.isfinite(channel.full_scale) and row.full_scale is not None:
        row = dataclasses.replace(row, full_scale=channel.full_scale)
    row = dataclasses.replace(row, **model.all.given())
    one = model.each.get(name)
    if one is None:
        return _by_path(row, model.path)
    site = row.site if one.site is None else one.site
    if isinstance(site, tuple) and len(site) == 1 and site[0][1] == 1.0:
        site = site[0][0]
    axis = row.axis if one.axis is None else one.axis
    row = dataclasses.replace(row, **one.given(), site=site, axis=axis)
    return _by_path(row, one.path or model.path)


def _by_path(row: Row, path: SignalPath) -> Row:
    """The row, looking at the same places through the casing's frequency responses if that is its path."""
    if path == "modes":
        return row
    cross = tuple((through_responses(name), part) for name, part in row.cross_axis)
    if isinstance(row.site, str):
        return dataclasses.replace(row, site=through_responses(row.site), cross_axis=cross)
    site = tuple((through_responses(name), weight) for name, weight in row.site)
    return dataclasses.replace(row, site=site, cross_axis=cross)


def _torques(model: TorquesModel, machine: Machine, where: str) -> tuple[Row, ...]:
    place = "sensors.torques"
    shafts = _shafts(model.shafts, (), machine, f"{where}: {place}")
    _check_each(model.each, shafts, f"{where}: {place}")
    if not shafts:
        return ()
    effects = _chain("torques", model.chain, where)
    rows = []
    for shaft in shafts:
        row = Row(torque_signal(shaft), torque_signal(shaft), unit="N*m")
        one = model.each[shaft].given() if shaft in model.each else {}
        row = dataclasses.replace(row, **{**effects.given(), **model.all.given(), **one})
        _check_row(row, place, where)
        rows.append(row)
    return tuple(rows)


def _chain(kind: str, name: str, where: str) -> Effects:
    names = chain_names(kind)
    if name not in names:
        raise InputError(where, f"sensors.{kind}.chain", name, "one of " + ", ".join(names))
    return chain(kind, name)


def _check_row(row: Row, place: str, where: str) -> None:
    if row.adc_bits is not None and row.full_scale is None:
        got = f"{row.adc_bits} bits without a range"
        raise InputError(where, f"{place}: adc_bits of {row.channel}", got, "a range, or adc_bits: off")
    if row.zero_per_k != 0.0 and row.temperature is None:
        field = f"{place}: zero_per_k of {row.channel}"
        raise InputError(where, field, row.zero_per_k, "a temperature beside it")


def _pickup(model: TachosModel | EncodersModel, shaft: str) -> Pickup:
    """The errors for all shafts, with what `each` says of this one."""
    names = Pickup.model_fields
    values = {name: getattr(model, name) for name in names}
    one = model.each.get(shaft)
    if one is not None:
        values |= {name: getattr(one, name) for name in one.model_fields_set}
    return Pickup.model_construct(**values)


def _check_each(each: Mapping[str, object], shafts: tuple[str, ...], where: str) -> None:
    for shaft in each:
        if shaft not in shafts:
            raise InputError(where, "each", shaft, "one of " + (", ".join(shafts) or "no shaft"))


def _shafts(
    wanted: tuple[str, ...] | None, default: tuple[str, ...], machine: Machine, where: str
) -> tuple[str, ...]:
    if wanted is None:
        return default
    known = [shaft.name for shaft in machine.shafts]
    for shaft in wanted:
        if shaft not in known:
            raise InputError(where, "shafts", shaft, "one of " + ", ".join(known))
    if len(set(wanted)) != len(wanted):
        raise InputError(where, "shafts", list(wanted), "each shaft once")
    return wanted
