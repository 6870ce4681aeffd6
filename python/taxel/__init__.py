"""Tactile sensors of conductive rubber: simulate, train, decode, export to C.

Readings are in Ω, lengths in mm, forces in N. Errors of what was given are `ValueError`, with the message of the command
`taxel`; work that failed is `RuntimeError`.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from taxel._native import __version__

if TYPE_CHECKING:
    from taxel._call import TaxelWarning
    from taxel._decoder import Decoder, Estimate
    from taxel._link import Link, Reading, list_ports
    from taxel._model import Model
    from taxel._recording import Recording, read_recording
    from taxel._results import Limit, Trade, evaluate, limit, trade
    from taxel._scene import Frames, Scene, synth

# Where each name stands: it is imported when it is used first. `Model` takes scikit-learn with it, which takes a second.
_PLACES = {
    "_call": ("TaxelWarning",),
    "_decoder": ("Decoder", "Estimate"),
    "_link": ("Link", "Reading", "list_ports"),
    "_model": ("Model",),
    "_recording": ("Recording", "read_recording"),
    "_results": ("Limit", "Trade", "evaluate", "limit", "trade"),
    "_scene": ("Frames", "Scene", "synth"),
}
__all__ = sorted([name for names in _PLACES.values() for name in names] + ["__version__"])


def __getattr__(name: str) -> object:
    for place, names in _PLACES.items():
        if name in names:
            return getattr(import_module(f"taxel.{place}"), name)
    raise AttributeError(f"module 'taxel' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
