#!/usr/bin/env python3
"""Write PNG pictures of one size side by side, or one after the other (an animated PNG), shrunk: README's picture.

    picture_row.py OUT.png WIDTH IN.png ...               (WIDTH of each picture in OUT, in pixels)
    picture_row.py --play SECONDS OUT.png WIDTH IN.png ...    (each is shown for SECONDS, the last three times as long)

Each pixel of OUT is the mean of the pixels of IN that it covers. doc/images/retract.png is made by

    omentum demo -o out/demo
    tools/picture_row.py --play 0.7 doc/images/retract.png 480 out/demo/run/frames/*.png

Pictures are 8-bit RGB without interlace, as omentum writes them.
"""
import struct
import sys
import zlib

GAP = 6  # white pixels between two pictures


def read(path):
    with open(path, "rb") as file:
        data = file.read()
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        sys.exit(f"{path}: not a PNG file")
    at, body, head = 8, b"", None
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        chunk = data[at + 8:at + 8 + size]
        at += 12 + size
        if kind == b"IHDR":
            head = struct.unpack(">IIBBBBB", chunk)
        elif kind == b"IDAT":
            body += chunk
    width, height, bits, colour, _, _, interlace = head
    if (bits, colour, interlace) != (8, 2, 0):
        sys.exit(f"{path}: not 8-bit RGB without interlace")
    return width, height, unfilter(zlib.decompress(body), width, height)


def paeth(a, b, c):
    p = a + b - c
    return min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]


def unfilter(raw, width, height):
    stride, rows, above = 3 * width, [], bytearray(3 * width)
    for row in range(height):
        start = row * (stride + 1)
        kind, line = raw[start], bytearray(raw[start + 1:start + 1 + stride])
        for i in range(stride):
            left = line[i - 3] if i >= 3 else 0
            corner = above[i - 3] if i >= 3 else 0
            guess = (0, left, above[i], (left + above[i]) // 2, paeth(left, above[i], corner))[kind]
            line[i] = (line[i] + guess) & 255
        rows.append(line)
        above = line
    return rows


def cover(n, small):
    """For each small pixel: (index, weight) of the pixels it covers."""
    out = []
    for k in range(small):
        lo, hi = k * n / small, (k + 1) * n / small
        out.append([(i, min(hi, i + 1) - max(lo, i)) for i in range(int(lo), min(n, int(hi - 1e-9) + 1))])
    return out


def shrink(width, height, rows, small):
    across, down = cover(width, small), cover(height, round(height * small / width))
    thin = [[sum(w * row[3 * i + c] for i, w in cells) for cells in across for c in range(3)] for row in rows]
    scale = small * len(down) / (width * height)
    return [bytes(int(0.5 + scale * sum(w * thin[j][k] for j, w in cells)) for k in range(3 * small)) for cells in down]


def chunk(kind, body):
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def squeeze(rows):
    """Rows as PNG keeps them: each byte less that of the pixel to the left (filter 1)."""
    lines = (bytes((b - a) & 255 for a, b in zip(b"\0\0\0" + row, row)) for row in rows)
    return zlib.compress(b"".join(b"\1" + line for line in lines), 9)


def side_by_side(path, width, pictures):
    """One picture of several, each of this width."""
    small = [shrink(*read(part), width) for part in pictures]
    write(path, [[(b"\xff" * 3 * GAP).join(lines) for lines in zip(*small)]], 0)


def write(path, pictures, seconds):
    """One picture, or several of one size that are shown in turn, for ever."""
    width, height, n = len(pictures[0][0]) // 3, len(pictures[0]), len(pictures)
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    out, number = [chunk(b"IHDR", head)], 0
    if n > 1:
        out.append(chunk(b"acTL", struct.pack(">II", n, 0)))
    for k, rows in enumerate(pictures):
        if n > 1:
            ms = round(1000 * seconds * (3 if k == n - 1 else 1))
            out.append(chunk(b"fcTL", struct.pack(">IIIIIHHBB", number, width, height, 0, 0, ms, 1000, 0, 0)))
            number += 1
        if k == 0:
            out.append(chunk(b"IDAT", squeeze(rows)))
        else:
            out.append(chunk(b"fdAT", struct.pack(">I", number) + squeeze(rows)))
            number += 1
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + b"".join(out) + chunk(b"IEND", b""))


def main():
    args, seconds = sys.argv[1:], 0
    if args and args[0] == "--play":
        seconds, args = float(args[1]), args[2:]
    if len(args) < 3:
        sys.exit(__doc__)
    if not seconds:
        return side_by_side(args[0], int(args[1]), args[2:])
    write(args[0], [shrink(*read(path), int(args[1])) for path in args[2:]], seconds)


if __name__ == "__main__":
    main()
