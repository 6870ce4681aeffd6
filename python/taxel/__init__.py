"""Simulate tactile sensors of conductive rubber, train models, decode, and export to C.

Readings are in Ω, lengths in mm, forces in N. Bad arguments raise `ValueError`, with the message of the command `taxel`;
work that fails raises `RuntimeError`.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from taxel._native import __version__ as __version__

if TYPE_CHECKING:
    from taxel._call import TaxelWarning as TaxelWarning
    from taxel._decoder import Decoder as Decoder, Estimate as Estimate
    from taxel._link import Link as Link, Reading as Reading, list_ports as list_ports
    from taxel._model import Model as Model
    from taxel._recording import Recording as Recording, read_recording as read_recording
    from taxel._results import Limit as Limit, Trade as Trade
    from taxel._results import evaluate as evaluate, limit as limit, trade as trade
    from taxel._scene import Frames as Frames, Scene as Scene, synth as synth

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
