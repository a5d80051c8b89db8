"""Faults of the transfer function and of classification: rows L of the table."""

import dataclasses

import numpy as np

from volref.arrays import Floats
from volref.emulation.textures.uploads import baked_table, domain_of
from volref.oracle.faults.fault import Subject
from volref.oracle.faults.making import fault, replaced, switched, switching
from volref.scene.transfer import TransferFunction


def _short(subject: Subject, entries: float) -> Subject:
    if entries >= subject.pipeline.table.size:
        return subject
    return switched(subject, table={"size": round(entries)})


def plain_table(subject: Subject) -> bool:
    """Tell whether a table's entries can be given as a transfer function: one of the value alone."""
    one_row = subject.pipeline.table.rows == 1 and subject.pipeline.table.baked != "canvas"
    transfer = subject.scene.transfer
    return one_row and isinstance(transfer, TransferFunction) and transfer.gradient_opacity is None


def entries_of(subject: Subject) -> Floats:
    """Return the entries (n, 4) that a program bakes into its table, before they are stored."""
    domain = domain_of(subject.scene, subject.pipeline)
    entries: Floats = baked_table(subject.scene, subject.pipeline, domain)[0]
    return entries


def with_entries(subject: Subject, entries: Floats) -> Subject:
    """Return a subject whose table has these entries (n, 4)."""
    domain, table = domain_of(subject.scene, subject.pipeline), subject.pipeline.table
    transfer = subject.scene.transfer
    assert transfer is not None
    changed = TransferFunction.from_lut(
        entries, domain, transfer.unit_distance, texel_centers=table.baked == "centers"
    )
    scene = dataclasses.replace(subject.scene, transfer=changed)
    pipeline = dataclasses.replace(subject.pipeline, domain=domain)
    return dataclasses.replace(subject, scene=scene, pipeline=pipeline)


def _coarse(subject: Subject, bits: float) -> Subject:
    """Return a subject whose table has entries of a few bits."""
    levels = 2 ** round(bits) - 1
    if levels >= 255 and subject.pipeline.table.format == "unorm8":
        return subject
    return with_entries(subject, np.rint(entries_of(subject) * levels) / levels)


TABLE = (
    fault(
        "L1-half-texel",
        "the table is read beside its entries",
        lambda subject, entries: switched(subject, table={"shift": entries}),
        strengths=(0.5, -0.5),
        fitted=True,
    ),
    fault(
        "L1-ends-for-centers",
        "the table's ends are taken for the centres of its outer entries, or the other way",
        replaced("table", "coordinate", {"direct": "centered", "centered": "direct"}),
    ),
    fault(
        "L2-short-table",
        "the table has too few entries",
        _short,
        strengths=(128.0, 64.0, 32.0, 16.0),
    ),
    fault(
        "L2-quantised-table",
        "the table's entries have too few bits",
        _coarse,
        where=plain_table,
        strengths=(8.0, 6.0, 4.0),
    ),
    fault(
        "L3-pre-classified",
        "voxels are classified before they are interpolated",
        switching(table={"order": "pre"}),
    ),
    fault(
        "L3-per-slice",
        "values are classified in each slice, then mixed",
        switching(table={"order": "per-slice"}),
        where=lambda subject: subject.pipeline.volume.layout == "atlas",
    ),
    fault(
        "L3-post-classified",
        "values are mixed between slices, then classified",
        replaced("table", "order", {"per-slice": "post"}),
    ),
)
