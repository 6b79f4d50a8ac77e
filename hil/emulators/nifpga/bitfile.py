"""Bitfiles of ours: the small part of an .lvbitx that nifpga reads, with the register names of the myRIO's personality.

There is no FPGA design inside. Names and types follow National Instruments' reference of the shipped personality;
offsets differ from one real bitfile to the next, and so do ours from any of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final
from xml.etree import ElementTree as Xml

SIGNATURE: Final = "50414D5249472D4D5952494F2D310001"
BASE_ADDRESS: Final = 0x18000
"""Where the registers begin on a myRIO; the emulator has no bus, and only writes it into the bitfile."""
TAGS: Final = {"Bool": "Boolean"}
"""Data type of nifpga -> tag of the bitfile, where they differ."""


@dataclass(frozen=True)
class Register:
    """One control or indicator."""

    name: str
    datatype: str = "U16"
    indicator: bool = False
    offset: int = 0

    @property
    def slot(self) -> int:
        """Its place in the file of registers."""
        return self.offset // 2


def numbered(registers: Sequence[Register], first: int = 2) -> list[Register]:
    """The same registers with offsets eight bytes apart from `first` on."""
    return [replace(register, offset=first + 8 * index) for index, register in enumerate(registers)]


def personality(datatype_c: str = "U16") -> list[Register]:
    """What the rig needs of a myRIO-1900. Connector C may be unsigned (two's complement in a U16) or I16."""
    inputs = [Register(f"AI.{bank}_{n}.VAL", indicator=True) for bank in "AB" for n in range(4)]
    outputs = [Register(f"AO.{bank}_{n}.VAL") for bank in "AB" for n in range(2)]
    signed = [Register(f"AI.C_{n}.VAL", datatype_c, indicator=True) for n in range(2)]
    signed += [Register(f"AO.C_{n}.VAL", datatype_c) for n in range(2)]
    system = [
        Register("AO.SYS.GO", "Bool"),
        Register("AO.SYS.STAT", "U8", indicator=True),
        Register("SYS.RDY", "Bool", indicator=True),
    ]
    return numbered(inputs + outputs + signed + system)


def guarded_personality() -> list[Register]:
    """A bitfile with a watchdog and limits in the FPGA, as one would build it for this rig."""
    guard = [Register("RIG.HEARTBEAT"), Register("RIG.WATCHDOG_MS"), Register("RIG.TRIPPED", "Bool", indicator=True)]
    limits = [Register(f"RIG.LIMIT.AO.A_{n}.{end}") for n in range(2) for end in ("MIN", "MAX")]
    safe = [Register(f"RIG.SAFE.AO.A_{n}") for n in range(2)]
    return numbered([*personality(), *guard, *limits, *safe])


def write_bitfile(path: Path, registers: Sequence[Register], signature: str = SIGNATURE) -> Path:
    """Write `registers` as an .lvbitx that nifpga.Bitfile reads."""
    root = Xml.Element("Bitfile")
    _add(root, "SignatureRegister", signature)
    register_list = Xml.SubElement(Xml.SubElement(root, "VI"), "RegisterList")
    for register in registers:
        entry = Xml.SubElement(register_list, "Register")
        _add(entry, "Name", register.name)
        _add(entry, "Indicator", str(register.indicator).lower())
        kind = Xml.SubElement(Xml.SubElement(entry, "Datatype"), TAGS.get(register.datatype, register.datatype))
        _add(kind, "Name", register.name)
        _add(entry, "Offset", str(register.offset))
        _add(entry, "Internal", "false")
        _add(entry, "AccessMayTimeout", "false")
    tree = Xml.SubElement(Xml.SubElement(root, "Project"), "CompilationResultsTree")
    results = Xml.SubElement(Xml.SubElement(tree, "CompilationResults"), "NiFpga")
    _add(results, "BaseAddressOnDevice", str(BASE_ADDRESS))
    Xml.SubElement(results, "DmaChannelAllocationList")
    Xml.indent(root)
    Xml.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)
    return path


def _add(parent: Xml.Element, tag: str, text: str) -> None:
    Xml.SubElement(parent, tag).text = text
