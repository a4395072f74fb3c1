#!/usr/bin/env python3
"""Makes the flash image and the UF2 file of the front end, and reads them back.

flash_image.py BOOT2 IMAGE FLASH UF2: boot2 and image as the linker made them; FLASH and UF2 are written.
"""
import struct
import sys

BOOT2_BYTES = 252  # and four of its checksum
FLASH_BEGIN = 0x10000000
UF2_FAMILY = 0xE48BFF56  # RP2040
UF2_BLOCK_BYTES = 256
UF2_MAGIC = (0x0A324655, 0x9E5D5157, 0x0AB16F30)
UF2_HAS_FAMILY = 0x2000
MARK_AT, MARK = 448, b"probebox-fe\0"  # ImageMark of protocol/receiver/front_end.hpp, its version behind it
POLYNOMIAL = 0x04C11DB7


def checksum(data):
    """The boot ROM's (data sheet, 2.8.1.3.1): CRC-32, not reflected, begun with ones, not inverted at the end."""
    crc = 0xFFFFFFFF
    for byte in data:
        crc ^= byte << 24
        for _ in range(8):
            crc = (crc << 1) ^ POLYNOMIAL if crc & 0x80000000 else crc << 1
            crc &= 0xFFFFFFFF
    return crc


def remainder(data):
    """The same by long division of one number, without a register: for the check alone."""
    bits = 8 * len(data) + 32
    number = (int.from_bytes(data, "big") << 32) ^ (0xFFFFFFFF << (bits - 32))
    divisor = 1 << 32 | POLYNOMIAL
    for shift in range(bits - 33, -1, -1):
        if number >> (shift + 32) & 1:
            number ^= divisor << shift
    return number


def flash_image(boot2, image):
    if len(boot2) > BOOT2_BYTES:
        raise SystemExit(f"boot2 has {len(boot2)} bytes, and room is for {BOOT2_BYTES}")
    boot2 = boot2.ljust(BOOT2_BYTES, b"\0")
    flash = boot2 + struct.pack("<I", checksum(boot2)) + image
    return flash + b"\xff" * (-len(flash) % UF2_BLOCK_BYTES)


def uf2(flash):
    blocks = [flash[i : i + UF2_BLOCK_BYTES] for i in range(0, len(flash), UF2_BLOCK_BYTES)]
    return b"".join(
        struct.pack(
            "<8I476sI", *UF2_MAGIC[:2], UF2_HAS_FAMILY, FLASH_BEGIN + i * UF2_BLOCK_BYTES, UF2_BLOCK_BYTES, i,
            len(blocks), UF2_FAMILY, block, UF2_MAGIC[2],
        )
        for i, block in enumerate(blocks)
    )  # fmt: skip


def flash_of(file):
    """The flash that a UF2 file makes; fails where the file is not right."""
    flash = bytearray()
    for at in range(0, len(file), 512):
        *head, data, end = struct.unpack("<8I476sI", file[at : at + 512])
        expected = [*UF2_MAGIC[:2], UF2_HAS_FAMILY, FLASH_BEGIN + len(flash), UF2_BLOCK_BYTES, at // 512,
                    len(file) // 512, UF2_FAMILY]  # fmt: skip
        if head != expected or end != UF2_MAGIC[2]:
            raise SystemExit(f"block {at // 512} of the UF2 file is wrong")
        flash += data[:UF2_BLOCK_BYTES]
    return bytes(flash)


def main(boot2_path, image_path, flash_path, uf2_path):
    with open(boot2_path, "rb") as boot2, open(image_path, "rb") as image:
        flash = flash_image(boot2.read(), image.read())
    with open(flash_path, "wb") as file:
        file.write(flash)
    with open(uf2_path, "wb") as file:
        file.write(uf2(flash))
    with open(uf2_path, "rb") as file:
        if flash_of(file.read()) != flash:
            raise SystemExit("the UF2 file does not hold the flash image")
    (stored,) = struct.unpack_from("<I", flash, BOOT2_BYTES)
    if remainder(flash[:BOOT2_BYTES]) != stored:
        raise SystemExit("the checksum of boot2 is wrong")
    if flash[MARK_AT : MARK_AT + len(MARK)] != MARK:
        raise SystemExit("the image has no mark at its place")
    minor, major = flash[MARK_AT + len(MARK) : MARK_AT + len(MARK) + 2]
    print(f"{uf2_path}: version {major}.{minor}, {len(flash)} bytes of flash, checksum of boot2 {stored:08x}; read back, and right")


if __name__ == "__main__":
    main(*sys.argv[1:])
