#!/usr/bin/env python3
"""Write the valid seed files of the binary formats into fuzz/corpus, without any imaging library.

The files are small (a few hundred bytes of data) and are committed; run this again only to add one.
"""
import gzip
import pathlib
import struct

CORPUS = pathlib.Path(__file__).resolve().parent / "corpus"


def put(name, data):
    path = CORPUS / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(data if isinstance(data, bytes) else data.encode())


def zipped(data):
    return gzip.compress(data, mtime=0)


def nifti1(order, dim, datatype, bitpix, voxels, qform=0, sform=0, units=2, slope=0.0, inter=0.0, offset=352.0,
           magic=b"n+1\0", quatern=(0, 0, 0), qfac=1.0):
    head = bytearray(348)
    def at(position, form, *values):
        struct.pack_into(order + form, head, position, *values)
    at(0, "i", 348)
    at(40, "8h", *dim)
    at(70, "2h", datatype, bitpix)
    at(76, "8f", qfac, 0.7, 0.8, 1.5, 1, 1, 1, 1)
    at(108, "3f", offset, slope, inter)
    head[123] = units
    at(252, "2h", qform, sform)
    at(256, "6f", *quatern, -10, 20, 30)
    at(280, "12f", 0.7, 0.1, 0, -10, -0.1, 0.8, 0, 20, 0, 0, 1.5, 30)
    head[344:348] = magic
    return bytes(head) + b"\0\0\0\0" + voxels


def nifti2(order, dim, datatype, bitpix, voxels):
    head = bytearray(540)
    def at(position, form, *values):
        struct.pack_into(order + form, head, position, *values)
    at(0, "i", 540)
    head[4:12] = b"n+2\0\r\n\x1a\n"
    at(12, "2h", datatype, bitpix)
    at(16, "8q", *dim)
    at(104, "8d", 1, 1, 1, 2, 1, 1, 1, 1)
    at(168, "q", 544)
    at(176, "2d", 0.5, -3)
    at(344, "2i", 0, 1)
    at(400, "12d", 0.7, 0.1, 0, -10, -0.1, 0.8, 0, 20, 0, 0, 1.5, 30)
    at(500, "i", 2)
    return bytes(head) + b"\0\0\0\0" + voxels


def niftis():
    dim = (3, 3, 4, 2, 1, 1, 1, 1)
    n = 24
    put("nifti/u8_sform.nii", nifti1("<", dim, 2, 8, bytes(range(n)), sform=1))
    put("nifti/u8_sform.nii.gz", zipped(nifti1("<", dim, 2, 8, bytes(range(n)), sform=1)))
    put("nifti/i16_qform.nii", nifti1("<", dim, 4, 16, struct.pack("<24h", *range(-12, 12)), qform=1,
                                      quatern=(0.1, 0.2, 0.3), qfac=-1.0, slope=2.0, inter=-5.0))
    put("nifti/i16_big_endian.nii", nifti1(">", dim, 4, 16, struct.pack(">24h", *range(n)), qform=1,
                                           quatern=(0, 0, 1)))
    put("nifti/f32_no_form.nii", nifti1("<", dim, 16, 32, struct.pack("<24f", *range(n)), units=0))
    put("nifti/f64_metres.nii", nifti1("<", dim, 64, 64, struct.pack("<24d", *range(n)), sform=2, units=1))
    put("nifti/i8_micron.nii", nifti1("<", dim, 256, 8, bytes(n), sform=2, units=3))
    put("nifti/u16_4d.nii", nifti1("<", (4, 3, 4, 2, 2, 1, 1, 1), 512, 16, bytes(96), sform=1))
    put("nifti/i32_no_offset.nii", nifti1("<", dim, 8, 32, bytes(96), sform=1, offset=0.0))
    put("nifti/pair.hdr", nifti1("<", dim, 2, 8, b"", sform=1, magic=b"ni1\0"))
    put("nifti/v2_i16.nii", nifti2("<", dim, 4, 16, struct.pack("<24h", *range(n))))
    put("nifti/v2_i64_big_endian.nii", nifti2(">", dim, 1024, 64, struct.pack(">24q", *range(n))))


def nrrd(fields, body, version=4):
    return f"NRRD000{version}\n# a seed\n{fields}\n".encode() + body


def nrrds():
    geometry = "dimension: 3\nsizes: 3 4 2\nspace: {}\nspace directions: (0.7,0,0) (0,0.8,0.1) (0,-0.1,1.5)\n" \
               "space origin: (-10,20.5,3e1)\n"
    put("nrrd/u8_raw.nrrd", nrrd("type: unsigned char\nencoding: raw\n"
                                 + geometry.format("left-posterior-superior"), bytes(range(24))))
    put("nrrd/i16_gzip.nrrd", nrrd("type: short\nencoding: gzip\nendian: little\n"
                                   + geometry.format("RAS") + 'space units: "mm" "mm" "mm"\n',
                                   zipped(struct.pack("<24h", *range(24))), 5))
    put("nrrd/i16_big_skip.nrrd", nrrd("type: int16\nencoding: raw\nendian: big\nbyte skip: -1\n"
                                       + geometry.format("LAS"), b"junk" + bytes(48)))
    put("nrrd/f32_text.nrrd", nrrd("type: float\nencoding: ascii\n" + geometry.format("scanner-xyz"),
                                   b"1 2.5 -3e2, 4\n" * 6))
    put("nrrd/spacings.nrrd", nrrd("type: uint8\nencoding: raw\ndimension: 3\nsizes: 3 4 2\nspacings: 1 nan 2\n"
                                   "content: a:=b\nkey:=value\n", bytes(24), 1))
    put("nrrd/list_axis.nrrd", nrrd("type: uchar\nencoding: raw\ndimension: 4\nsizes: 2 3 4 2\nspace: LPS\n"
                                    "space directions: none (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\n"
                                    "kinds: list domain domain domain\nlineskip: 1\nbyteskip: 2\n",
                                    b"a line\nxx" + bytes(48)))
    put("nrrd/text_list_axis.nrrd", nrrd("type: double\nencoding: text\ndimension: 4\nsizes: 3 4 2 2\n"
                                         "space dimension: 3\nspace directions: (1,0,0) (0,1,0) (0,0,1) none\n"
                                         'space units: "m" "cm" "um"\n', b"7 " * 48))
    put("nrrd/detached.nhdr", nrrd("type: uchar\nencoding: raw\n" + geometry.format("LPS")
                                   + "data file: voxels.raw\n", b""))
    put("nrrd/list_of_files.nhdr", nrrd("type: uchar\nencoding: raw\n" + geometry.format("LPS")
                                        + "data file: LIST\n", b"a\nb\n"))
    put("nrrd/i64_swapped.nrrd", nrrd("type: long long int\nencoding: raw\nendian: big\n"
                                      + geometry.format("LPS"), struct.pack(">24q", *range(24))))


if __name__ == "__main__":
    niftis()
    nrrds()
