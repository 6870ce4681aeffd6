"""The firmware's image: an ELF file as the linker made it."""

import bisect
import struct

from elftools.elf.elffile import ELFFile

from .rules import Fault


class Image:
    """Segments by their address in flash, and symbols."""

    def __init__(self, path):
        with open(path, "rb") as file:
            elf = ELFFile(file)
            loaded = (part for part in elf.iter_segments("PT_LOAD") if part["p_filesz"])
            self.segments = [(part["p_paddr"], part.data()) for part in loaded]
            symbols = list(elf.get_section_by_name(".symtab").iter_symbols())
        self.symbols = {symbol.name: symbol["st_value"] for symbol in symbols}
        functions = (s for s in symbols if s["st_info"]["type"] == "STT_FUNC")
        self._functions = sorted((s["st_value"] & ~1, s.name) for s in functions)

    def panic_place(self):
        """Address of the first constant that tells the place of a panic: pointer to a file's name, its length, line and
        column."""
        for start, data in self.segments:
            for place in range(0, len(data) - 15, 4):
                name, length, line, column = struct.unpack_from("<4I", data, place)
                text = data[name - start:name - start + length] if name >= start and 3 < length < 256 else b""
                if text.endswith(b".rs") and 0 < line < 1 << 16 and 0 < column < 256:
                    return start + place
        raise Fault("the image tells no place of a panic")

    def place(self, address):
        """The function that holds `address`, and the offset in it."""
        index = bisect.bisect_right(self._functions, (address, "\x7f")) - 1
        if index < 0:
            return f"{address:#x}"
        start, name = self._functions[index]
        return f"{name[:60]}+{address - start:#x}"
