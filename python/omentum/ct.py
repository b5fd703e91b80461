"""A CT made here, for trials without a file: fat over an organ with a tumour, in gas."""
from __future__ import annotations

import ctypes
from typing import Any

from . import _capi as c
from ._lib import lib
from .volume import Volume

CT_LABELS = {"gas": 0, "fat": 1, "organ": 2, "tumour": 3}


def make_ct(seed: int = 1, **fields: Any) -> tuple[Volume, Volume]:
    """A volume in Hounsfield units, blurred and with noise, and the labels (CT_LABELS) that it was made from.

    fields of OmCtDef, m: voxel, organ_half, fat_half, fat_thickness, tumour_radius, tumour_shift (2), ...; noise (HU).
    """
    definition = lib.om_ct_default_def(seed)
    definition.assign(fields)
    ct, truth = c.OmVolume(), c.OmVolume()
    lib.om_ct_make(ctypes.byref(definition), ctypes.byref(ct), ctypes.byref(truth))
    labels = Volume._take(truth)
    return Volume._take(ct), Volume(labels.values.astype("uint8"), affine=labels.affine)


def label_ct(ct: Volume) -> Volume:
    """Labels (CT_LABELS) of a volume in Hounsfield units, by thresholds."""
    raw = c.OmVolume()
    lib.om_ct_label(ctypes.byref(ct._as_c()), ctypes.byref(raw))
    labels = Volume._take(raw)
    return Volume(labels.values.astype("uint8"), affine=labels.affine)


__all__ = ["CT_LABELS", "label_ct", "make_ct"]
