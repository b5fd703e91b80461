#!/usr/bin/env python3
"""Write the valid seed files of the binary formats into fuzz/corpus, without any imaging library.

The files are small (a few hundred bytes of data) and are committed; run this again only to add one.
"""
import base64
import gzip
import json
import pathlib
import struct
import zlib

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
    put("nifti/mirrored.nii", nifti1("<", dim, 2, 8, bytes(range(n)), qform=1, sform=1, quatern=(0.1, 0.2, 0.3), qfac=-1.0))
    put("nifti/f32_no_form.nii", nifti1("<", dim, 16, 32, struct.pack("<24f", *range(n)), units=0))
    put("nifti/f64_metres.nii", nifti1("<", dim, 64, 64, struct.pack("<24d", *range(n)), sform=2, units=1))
    put("nifti/i8_micron.nii", nifti1("<", dim, 256, 8, bytes(n), sform=2, units=3))
    put("nifti/u16_4d.nii", nifti1("<", (4, 3, 4, 2, 2, 1, 1, 1), 512, 16, bytes(96), sform=1))
    table = b"<LabelTable><Label Key=\"5\"><![CDATA[liver]]></Label><Label Key=\"6\">vein</Label></LabelTable>"
    head = nifti1("<", dim, 2, 8, b"", sform=1, offset=352.0 + 8 + len(table))[:348]
    put("nifti/u8_names.nii", head + b"\1\0\0\0" + struct.pack("<2i", 8 + len(table), 30) + table + bytes(range(n)))
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
    put("nrrd/nan_axis.nrrd", nrrd("type: uchar\nencoding: raw\ndimension: 4\nsizes: 2 3 4 2\nspace: RAS\n"
                                   "space directions: (nan,nan,nan) (1,0,0) (0,2,0) (0,0,3)\n", bytes(48)))
    put("nrrd/text_list_axis.nrrd", nrrd("type: double\nencoding: text\ndimension: 4\nsizes: 3 4 2 2\n"
                                         "space dimension: 3\nspace directions: (1,0,0) (0,1,0) (0,0,1) none\n"
                                         'space units: "m" "cm" "um"\n', b"7 " * 48))
    put("nrrd/layers.seg.nrrd", nrrd("type: uchar\nencoding: raw\ndimension: 4\nsizes: 2 3 4 2\nspace: LPS\n"
                                     "kinds: list domain domain domain\nspace directions: none (1,0,0) (0,1,0) "
                                     "(0,0,1)\nspace origin: (0,0,0)\nSegment0_ID:=Segment_1\nSegment0_Layer:=0\n"
                                     "Segment0_LabelValue:=1\nSegment0_Name:=liver\nSegment1_Name:=vein\n"
                                     "Segment1_Layer:=1\nSegment1_LabelValue:=2\nSegmentation_Source:=x\n",
                                     bytes(48)))
    put("nrrd/detached.nhdr", nrrd("type: uchar\nencoding: raw\n" + geometry.format("LPS")
                                   + "data file: voxels.raw\n", b""))
    put("nrrd/list_of_files.nhdr", nrrd("type: uchar\nencoding: raw\n" + geometry.format("LPS")
                                        + "data file: LIST\n", b"a\nb\n"))
    put("nrrd/i64_swapped.nrrd", nrrd("type: long long int\nencoding: raw\nendian: big\n"
                                      + geometry.format("LPS"), struct.pack(">24q", *range(24))))


# Two tetrahedra that share a face, and the surface of the first.
POINTS = [(0, 0, 0), (10, 0, 0), (0, 10, 0), (0, 0, 10), (8, 8, 8.5)]
TETS = [(0, 1, 2, 3), (1, 4, 2, 3)]
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]


# The same tetrahedra with nodes at the midpoints of edges, in VTK's order; Gmsh has the last two the other way round.
EDGES = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]
ENDS = sorted({tuple(sorted((t[a], t[b]))) for t in TETS for a, b in EDGES})
NODES = POINTS + [tuple((u + v) / 2 for u, v in zip(POINTS[a], POINTS[b])) for a, b in ENDS]
TETS10 = [t + tuple(len(POINTS) + ENDS.index(tuple(sorted((t[a], t[b])))) for a, b in EDGES) for t in TETS]
TETS10_MSH = [t[:8] + (t[9], t[8]) for t in TETS10]


def lines(rows, shift=0):
    return "".join(" ".join(str(v + shift) for v in row) + "\n" for row in rows)


def numbered(rows, prefix="", shift=0, first=1):
    return "".join(f"{n} {prefix}" + " ".join(str(v + shift) for v in row) + "\n"
                   for n, row in enumerate(rows, first))


def mshes():
    names = '$PhysicalNames\n2\n2 1 "attachment"\n3 7 "fat tissue"\n$EndPhysicalNames\n'
    elements = "$Elements\n4\n1 2 2 1 1 1 3 2\n2 15 2 1 1 1\n" + \
        numbered(TETS, "4 2 7 1 ", 1, 3) + "$EndElements\n"
    put("msh/v2_text.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n" + names + "$Nodes\n5\n" + numbered(POINTS)
        + "$EndNodes\n" + elements)
    put("msh/v1.msh", "$NOD\n5\n" + numbered(POINTS) + "$ENDNOD\n$ELM\n2\n"
        + numbered(TETS, "4 7 1 4 ", 1) + "$ENDELM\n")
    nodes = b"".join(struct.pack("<i3d", n, *p) for n, p in enumerate(POINTS, 1))
    tets = struct.pack("<3i", 4, 2, 2) + b"".join(
        struct.pack("<7i", n, 7, 1, *(v + 1 for v in t)) for n, t in enumerate(TETS, 1))
    put("msh/v2_binary.msh", b"$MeshFormat\n2.2 1 8\n" + struct.pack("<i", 1) + b"\n$EndMeshFormat\n" + names.encode()
        + b"$Nodes\n5\n" + nodes + b"\n$EndNodes\n$Elements\n2\n" + tets + b"\n$EndElements\n")
    entities = "$Entities\n0 0 1 1\n1 0 0 0 10 10 10 1 1 0\n1 0 0 0 10 10 10 1 7 1 1\n$EndEntities\n"
    put("msh/v4_text.msh", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n" + names + entities
        + "$Nodes\n1 5 1 5\n3 1 0 5\n1\n2\n3\n4\n5\n" + lines(POINTS) + "$EndNodes\n"
        + "$Elements\n2 3 1 3\n2 1 2 1\n1 1 3 2\n3 1 4 2\n" + numbered(TETS, "", 1, 2) + "$EndElements\n")
    put("msh/v4_parametric.msh", "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n2 5 3 30\n2 4 1 4\n3\n20\n7\n30\n"
        + lines(p + (0.5, 0.25) for p in POINTS[:4]) + "3 1 1 1\n9\n" + lines(p + (0, 0, 1) for p in POINTS[4:])
        + "$EndNodes\n$Periodic\n0\n$EndPeriodic\n$Elements\n1 2 1 2\n3 1 4 2\n5 3 20 7 30\n6 20 9 7 30\n$EndElements\n")
    n = len(NODES)
    put("msh/v2_tet10.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n" + names + f"$Nodes\n{n}\n" + numbered(NODES)
        + "$EndNodes\n$Elements\n3\n1 9 2 1 1 " + " ".join(str(TETS10[0][k] + 1) for k in (0, 2, 1, 6, 5, 4)) + "\n"
        + numbered(TETS10_MSH, "11 2 7 1 ", 1, 2) + "$EndElements\n")
    nodes = struct.pack("<4Q", 1, n, 1, n) + struct.pack("<3iQ", 3, 1, 0, n) + \
        struct.pack(f"<{n}Q", *range(1, n + 1)) + b"".join(struct.pack("<3d", *p) for p in NODES)
    tets = struct.pack("<4Q", 1, 2, 1, 2) + struct.pack("<3iQ", 3, 1, 11, 2) + b"".join(
        struct.pack("<11Q", n, *(v + 1 for v in t)) for n, t in enumerate(TETS10_MSH, 1))
    put("msh/v4_tet10_binary.msh", b"$MeshFormat\n4.1 1 8\n" + struct.pack("<i", 1) + b"\n$EndMeshFormat\n$Nodes\n"
        + nodes + b"\n$EndNodes\n$Elements\n" + tets + b"\n$EndElements\n")
    entities = struct.pack("<4Q", 0, 0, 1, 1) + \
        struct.pack("<i6dQiQ", 1, 0, 0, 0, 10, 10, 10, 1, 1, 0) + \
        struct.pack("<i6dQiQi", 1, 0, 0, 0, 10, 10, 10, 1, 7, 1, 1)
    nodes = struct.pack("<4Q", 1, 5, 1, 5) + struct.pack("<3iQ", 3, 1, 0, 5) + struct.pack("<5Q", 1, 2, 3, 4, 5) + \
        b"".join(struct.pack("<3d", *p) for p in POINTS)
    tets = struct.pack("<4Q", 1, 2, 1, 2) + struct.pack("<3iQ", 3, 1, 4, 2) + b"".join(
        struct.pack("<5Q", n, *(v + 1 for v in t)) for n, t in enumerate(TETS, 1))
    put("msh/v4_binary.msh", b"$MeshFormat\n4.1 1 8\n" + struct.pack("<i", 1) + b"\n$EndMeshFormat\n" + names.encode()
        + b"$Entities\n" + entities + b"\n$EndEntities\n$Nodes\n" + nodes + b"\n$EndNodes\n$Elements\n" + tets
        + b"\n$EndElements\n")


def vtks():
    head = "# vtk DataFile Version {}\ntwo tetrahedra\n{}\nDATASET {}\n"
    cells = lines((4,) + t for t in TETS)
    data = "CELL_DATA 2\nSCALARS tet_label int 1\nLOOKUP_TABLE default\n1\n2\n" \
        "POINT_DATA 5\nFIELD FieldData 2\nattachment 1 5 unsigned_char\n1 0 0 1 0\nu 3 5 float\n" + "0 " * 15 + "\n" \
        "VECTORS v double\n" + "1 " * 15 + "\nNORMALS n float\n" + "0 " * 15 + "\n"
    put("vtk/text.vtk", head.format("3.0", "ASCII", "UNSTRUCTURED_GRID") + "POINTS 5 double\n" + lines(POINTS)
        + "CELLS 2 10\n" + cells + "CELL_TYPES 2\n10\n10\n" + data)
    put("vtk/polydata.vtk", head.format("2.0", "ASCII", "POLYDATA") + "POINTS 4 float\n" + lines(POINTS[:4])
        + "POLYGONS 4 16\n" + lines((3,) + f for f in FACES))
    points = b"".join(struct.pack(">3f", *p) for p in POINTS)
    tets = b"".join(struct.pack(">5i", 4, *t) for t in TETS)
    put("vtk/binary.vtk", head.format("3.0", "BINARY", "UNSTRUCTURED_GRID").encode() + b"POINTS 5 float\n" + points
        + b"\nCELLS 2 10\n" + tets + b"\nCELL_TYPES 2\n" + struct.pack(">2i", 10, 10)
        + b"\nCELL_DATA 2\nSCALARS tet_label int\nLOOKUP_TABLE default\n" + struct.pack(">2i", 1, 2)
        + b"\nPOINT_DATA 5\nSCALARS attachment unsigned_char\nLOOKUP_TABLE default\n\1\0\0\1\0\n")
    # VTK puts a paragraph of metadata, closed by an empty line, behind an array
    put("vtk/metadata.vtk", head.format("4.2", "ASCII", "UNSTRUCTURED_GRID") + "POINTS 5 double\n" + lines(POINTS)
        + "METADATA\nINFORMATION 1\nNAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 0 14\n\nCELLS 2 10\n" + cells
        + "CELL_TYPES 2\n10\n10\nCELL_DATA 2\nFIELD FieldData 2\nu 1 2 double\n0 1\nMETADATA\nINFORMATION 0\n\n"
        "tet_label 1 2 vtktypeint32\n1 2\n\nPOINT_DATA 5\nFIELD FieldData 1\ntwo%20words 1 5 vtktypeuint8\n1 0 0 1 0\n")
    put("vtk/v5.vtk", head.format("5.1", "ASCII", "UNSTRUCTURED_GRID") + "POINTS 5 double\n" + lines(POINTS)
        + "CELLS 3 8\nOFFSETS vtktypeint64\n0 4 8\nCONNECTIVITY vtktypeint64\n" + lines(TETS) + "CELL_TYPES 2\n10\n10\n")


    nodes = f"POINTS {len(NODES)} double\n" + lines(NODES)
    tail = "CELLS 2 22\n" + lines((10,) + t for t in TETS10) + "CELL_TYPES 2\n24\n24\nCELL_DATA 2\n" \
        "SCALARS tet_label int 1\nLOOKUP_TABLE default\n1\n2\n"
    put("vtk/tet10.vtk", head.format("3.0", "ASCII", "UNSTRUCTURED_GRID") + nodes + tail)
    curved = f"POINTS {len(NODES)} double\n" + lines(NODES[:5] + [(5, -1, 0)] + NODES[6:])
    put("vtk/tet10_curved.vtk", head.format("3.0", "ASCII", "UNSTRUCTURED_GRID") + curved + tail)


def vtus():
    def grid(body, extra="", tail="", npoint=5):
        return f'<?xml version="1.0"?>\n<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" ' \
            f'header_type="UInt32"{extra}>\n<!-- a seed -->\n<UnstructuredGrid>\n<Piece NumberOfPoints="{npoint}" ' \
            f'NumberOfCells="2">\n{body}</Piece>\n</UnstructuredGrid>\n{tail}</VTKFile>\n'

    def arrays(form):
        def array(name, kind, values, components=1):
            return f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" {form(kind, values)}'
        flat = [v for p in POINTS for v in p]
        return "<PointData>\n" + array("attachment", "UInt8", [1, 0, 0, 1, 0]) + "</PointData>\n<CellData>\n" \
            + array("tet_label", "Int32", [1, 2]) + "</CellData>\n<Points>\n" + array("Points", "Float64", flat, 3) \
            + "</Points>\n<Cells>\n" + array("connectivity", "Int64", [v for t in TETS for v in t]) \
            + array("offsets", "Int32", [4, 8]) + array("types", "UInt8", [10, 10]) + "</Cells>\n"

    letter = {"UInt8": "B", "Int32": "i", "Int64": "q", "Float64": "d"}

    def packed(kind, values):
        return struct.pack(f"<{len(values)}{letter[kind]}", *values)

    def text(_, values):
        return 'format="ascii">' + " ".join(map(str, values)) + "</DataArray>\n"

    def inline(kind, values):
        raw = packed(kind, values)
        return 'format="binary">' + base64.b64encode(struct.pack("<I", len(raw)) + raw).decode() + "</DataArray>\n"

    def inline_zlib(kind, values):
        raw = packed(kind, values)
        body = zlib.compress(raw)
        head = struct.pack("<4I", 1, len(raw), len(raw), len(body))
        return 'format="binary">' + base64.b64encode(head).decode() + base64.b64encode(body).decode() + "</DataArray>\n"

    def tet10(name, kind, values, components=1):
        return f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" {inline_zlib(kind, values)}'

    put("vtu/text.vtu", grid(arrays(text)))
    put("vtu/tet10_zlib.vtu", grid(
        "<PointData>\n" + tet10("attachment", "UInt8", [1, 0, 0, 1, 0, 1, 1] + [0] * (len(NODES) - 7))
        + "</PointData>\n<Points>\n" + tet10("Points", "Float64", [v for p in NODES for v in p], 3)
        + "</Points>\n<Cells>\n" + tet10("connectivity", "Int64", [v for t in TETS10 for v in t])
        + tet10("offsets", "Int32", [10, 20]) + tet10("types", "UInt8", [24, 24]) + "</Cells>\n",
        ' compressor="vtkZLibDataCompressor"', npoint=len(NODES)))
    fields = '<FieldData>\n<DataArray type="String" Name="SPACE" NumberOfTuples="1" format="ascii">76 80 83 0' \
        '</DataArray>\n<DataArray type="Float64" Name="metres_per_unit" format="ascii">0.01</DataArray>\n</FieldData>\n'
    put("vtu/fields.vtu", grid(arrays(text)).replace("<Piece", fields + "<Piece", 1))
    put("vtu/is_lps.vtu", grid(arrays(text)).replace(
        "<Piece", fields.replace('"String" Name="SPACE"', '"Int32" Name="is_lps"').replace("76 80 83 0", "1") + "<Piece", 1))
    put("vtu/inline.vtu", grid(arrays(inline)))
    put("vtu/zlib.vtu", grid(arrays(inline_zlib), ' compressor="vtkZLibDataCompressor"'))
    for encoding in ("raw", "base64"):
        block = bytearray()

        def appended(kind, values):
            raw = packed(kind, values)
            raw = struct.pack("<I", len(raw)) + raw
            at = len(block)
            block.extend(raw if encoding == "raw" else base64.b64encode(raw))
            return f'format="appended" offset="{at}"/>\n'
        page = grid(arrays(appended), tail="@@").encode()
        tail = f'<AppendedData encoding="{encoding}">\n_'.encode() + bytes(block) + b"\n</AppendedData>\n"
        put(f"vtu/appended_{encoding}.vtu", page.replace(b"@@", tail))


def clouds():
    normals = [(0, 0, 1), (0, 0, 2), (0, 0, 0), (1, 0, 0), (0, -1, 0)]

    def page(body, extra="", tail=""):
        return f'<?xml version="1.0"?>\n<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" ' \
            f'header_type="UInt32"{extra}>\n<PolyData>\n<Piece NumberOfPoints="5" NumberOfVerts="0" NumberOfStrips="1" ' \
            f'NumberOfPolys="2">\n{body}</Piece>\n</PolyData>\n{tail}</VTKFile>\n'

    def arrays(form):
        def array(name, kind, values, components=1):
            return f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}" {form(kind, values)}'
        return '<PointData Normals="Normals">\n' + array("Normals", "Float32", [v for n in normals for v in n], 3) \
            + "</PointData>\n<Points>\n" + array("Points", "Float64", [v for p in POINTS for v in p], 3) + "</Points>\n" \
            + "<Polys>\n" + array("connectivity", "Int64", [0, 1, 2, 0, 1, 3, 2]) + array("offsets", "Int32", [3, 7]) \
            + "</Polys>\n<Strips>\n" + array("connectivity", "Int64", [0, 1, 2, 4]) + array("offsets", "Int32", [4]) \
            + "</Strips>\n"

    def packed(kind, values):
        letter = {"Int32": "i", "Int64": "q", "Float32": "f", "Float64": "d"}
        return struct.pack(f"<{len(values)}{letter[kind]}", *values)

    def text(_, values):
        return 'format="ascii">' + " ".join(map(str, values)) + "</DataArray>\n"

    def inline_zlib(kind, values):
        raw = packed(kind, values)
        body = zlib.compress(raw)
        head = struct.pack("<4I", 1, len(raw), len(raw), len(body))
        return 'format="binary">' + base64.b64encode(head).decode() + base64.b64encode(body).decode() + "</DataArray>\n"

    put("vtp/text.vtp", page(arrays(text)))
    put("vtp/zlib.vtp", page(arrays(inline_zlib), ' compressor="vtkZLibDataCompressor"'))
    block = bytearray()

    def appended(kind, values):
        raw = packed(kind, values)
        at = len(block)
        block.extend(struct.pack("<I", len(raw)) + raw)
        return f'format="appended" offset="{at}"/>\n'
    raw = page(arrays(appended), tail="@@").encode()
    put("vtp/appended_raw.vtp", raw.replace(b"@@", b'<AppendedData encoding="raw">\n_' + bytes(block) + b"\n</AppendedData>\n"))
    put("csv/commas.csv", "# omentum SPACE=LPS UNIT=mm\nx,y,z,nx,ny,nz\n0,0,0,0,0,1\n1,0,0,,,\n0,1e-3,0,0,0,0\n0,0,nan,0,0,1\n")
    put("csv/semicolons.csv", "\ufeffid;X;Y;Z\r\na;1;2;3\r\nb;-.5;6;1e300\r\n\r\nc;1;2;3\r\n".encode())
    put("csv/paraview.csv", '"Points:0"\t"Points:1"\t"Points:2"\t"p"\n1\t2\t3\t9\n"4"\t5\t6\t')
    put("csv/sheet.csv", "x,y,z\n" + "".join(f"{i % 6},{i // 6},{i * i % 7 / 10}\n" for i in range(36)))
    put("csv/decimal_commas.csv", "x;y;z\n1,5;2,5;3,5\n")
    put("ply/cloud.ply", "ply\nformat ascii 1.0\nelement vertex 5\n"
        + "".join(f"property float {n}\n" for n in ("x", "y", "z", "nx", "ny", "nz")) + "end_header\n"
        + lines(tuple(p) + n for p, n in zip(POINTS, normals)))


def surfaces():
    corners = [[POINTS[v] for v in f] for f in FACES]
    put("stl/text.stl", "solid two words\n" + "".join(
        "facet normal 0 0 1\n outer loop\n" + "".join(f"  vertex {x} {y} {z}\n" for x, y, z in c)
        + " endloop\nendfacet\n" for c in corners) + "endsolid two words\n")
    put("stl/space.stl", b"3D Slicer output. SPACE=LPS UNIT=cm".ljust(80) + struct.pack("<I", 4) + b"".join(
        struct.pack("<12fH", 0, 0, 0, *(c for v in f for c in POINTS[v]), 0) for f in FACES))
    put("obj/space.obj", "# 3D Slicer output. SPACE=LPS\n#UNIT=0.5\n" + "".join(f"v {x} {y} {z}\n" for x, y, z in POINTS[:4])
        + "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    put("stl/binary.stl", b"solid but binary".ljust(80) + struct.pack("<I", 4) + b"".join(
        struct.pack("<3f", 0, 0, 1) + b"".join(struct.pack("<3f", *p) for p in c) + b"\0\0" for c in corners))
    put("obj/faces.obj", "# seed\nmtllib a.mtl\no one\n" + "".join(f"v {x} {y} {z}\n" for x, y, z in POINTS[:4])
        + "vn 0 0 1\nvt 0 0\ng side\nusemtl m\ns off\nf 1 3 2\nf 1/1 2/1 4/1\nf 1//1 4//1 3//1\nf -3/1/1 -2/1/1 -1/1/1\n")
    put("obj/quad.obj", "v 0 0 0\nv 1 0 0 1.0\nv 1 1 0 0.5 0.5 0.5\nv 0 1 0\nf 1 2 \\\n3 4\nl 1 2\np 1\n")
    head = "ply\nformat {} 1.0\ncomment seed\nelement vertex 4\nproperty float x\nproperty float y\n" \
        "property float z\nproperty uchar red\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n"
    put("ply/text.ply", head.format("ascii") + lines(p + (7,) for p in POINTS[:4]) + lines((3,) + f for f in FACES))
    for name, order in (("little", "<"), ("big", ">")):
        put(f"ply/{name}.ply", head.format(f"binary_{name}_endian").encode()
            + b"".join(struct.pack(order + "3fB", *p, 7) for p in POINTS[:4])
            + b"".join(struct.pack(order + "B3i", 3, *f) for f in FACES))
    put("ply/double_list.ply", "ply\nformat ascii 1.0\nobj_info x\nelement vertex 4\nproperty double x\n"
        "property double y\nproperty double z\nproperty list int float extra\nelement face 1\nproperty int32 flag\n"
        "property list uint8 uint32 vertex_index\nelement edge 1\nproperty short a\nend_header\n"
        + lines(p + (2, 0.5, 1) for p in POINTS[:4]) + "1 4 0 1 2 3\n5\n")
    put("off/plain.off", "OFF\n4 4 6\n" + lines(POINTS[:4]) + lines((3,) + f for f in FACES))
    put("off/comments.off", "# seed\nOFF 4 1 0\n" + lines(POINTS[:4]) + "4 0 1 2 3 255 0 0\n")


def safetensors(entries, data, meta=None, pad=0):
    head = ({"__metadata__": meta} if meta else {}) | {
        name: {"dtype": kind, "shape": shape, "data_offsets": [begin, end]} for name, kind, shape, begin, end in entries}
    text = json.dumps(head, separators=(",", ":")).encode() + b" " * pad
    return struct.pack("<Q", len(text)) + text + data


def weights():
    put("safetensors/two.safetensors", safetensors(
        [("conv.weight", "F32", [2, 1, 3], 0, 24), ("conv.bias", "F32", [2], 24, 32)], struct.pack("<8f", *range(8)),
        {"units": "m", "network": "0123456789abcdef"}, pad=5))
    put("safetensors/types.safetensors", safetensors(
        [("d", "F64", [2], 0, 16), ("h", "F16", [3], 16, 22), ("b", "BF16", [1, 1], 22, 24), ("i", "I64", [], 24, 32),
         ("u", "U8", [0, 7], 32, 32)], struct.pack("<2d3eHq", 1, -2, 0.5, 6e-8, 65504, 0x3f80, 7)))
    put("safetensors/empty.safetensors", safetensors([], b""))
    put("safetensors/overlap.safetensors", safetensors(
        [("a", "F32", [2], 0, 8), ("b", "F32", [2], 4, 12)], bytes(12)))
    put("safetensors/hole.safetensors", safetensors([("a", "F32", [1], 4, 8)], bytes(8)))
    put("safetensors/huge_empty.safetensors", safetensors([("a", "F32", [2**63 - 1, 2**63 - 1, 0], 0, 0)], b""))


def umesh():
    """Heads of shards, and changes of values as fuzz_umesh_shard.c reads them: nine bytes each."""
    def real(what, value):
        return struct.pack("<Bd", what, value)

    def whole(what, value, place=0, byte=0):
        return struct.pack("<BiBB2x", what, value, place, byte)

    put("umesh/head.txt", "omentum umesh 1\nsize 8\nhash 0123456789abcdef\n".ljust(512, "\0") + "whatever")
    put("umesh/other.txt", "omentum umesh 7\nsize 0\nhash 0\n")
    put("umesh/grid.bin", real(0, 0.02) + real(1, 1.5) + real(2, 0.5) + whole(4, 0, 0, 1) + whole(5, 3, 0, 1))
    put("umesh/samples.bin", whole(7, 100) + real(8, 0.3) + whole(9, -1, 1) + whole(11, 0, 4, 9))
    put("umesh/dim.bin", whole(3, 7, 1))
    put("umesh/spacing.bin", real(0, float("nan")))
    put("umesh/first.bin", whole(7, -4))
    put("umesh/skin.bin", real(6, float("inf")))
    put("umesh/u.bin", struct.pack("<Bf4x", 10, float("nan")))


def banet():
    """Heads of shards, and changes of values as fuzz_banet_shard.c reads them: nine bytes each."""
    def real(kind, value):
        return struct.pack("<Bd", kind, value)
    def whole(kind, value, *rest):
        return struct.pack("<Bi4B", kind, value, *(rest + (0, 0, 0, 0))[:4])
    put("banet/head.txt", "omentum banet 1\nsize 8\nhash 0123456789abcdef\n".ljust(512, "\0") + "whatever")
    put("banet/other.txt", "omentum banet 7\nsize 0\nhash 0\n")
    put("banet/none.bin", b"")
    put("banet/good.bin", real(3, 0.5) + whole(5, 7, 9) + whole(6, 100, 3, 0, 1) + real(9, 1e4))
    put("banet/dim.bin", whole(1, 32, 1) + whole(1, 48, 2))
    put("banet/small.bin", whole(1, 0, 0))
    put("banet/cell.bin", whole(4, -1, 3) + whole(4, 1 << 30, 9, 0, 0, 1))
    put("banet/value.bin", whole(6, -32768, 5, 0, 2) + whole(6, 600, 5, 0, 0))
    put("banet/first.bin", whole(7, -4) + whole(8, 3))
    put("banet/voxel.bin", real(0, float("nan")))
    put("banet/side.bin", real(10, -0.3) + real(2, 1e300))


def rl_demo():
    """Heads of files, and changes of values as fuzz_rl_demo.c reads them: nine bytes each."""
    def whole(kind, value, *rest):
        return struct.pack("<Bi4B", kind, value, *(rest + (0, 0, 0, 0))[:4])
    put("rl_demo/head.txt", "omentum demonstrations 1\nsize 8\nhash 0123456789abcdef\n".ljust(512, "\0") + "whatever")
    put("rl_demo/other.txt", "omentum demonstrations 7\nsize 0\nhash 0\n")
    put("rl_demo/none.bin", b"")
    put("rl_demo/good.bin", whole(1, 2, 3, 0, 1) + struct.pack("<Bf4B", 0, 0.5, 2, 0, 1, 0))
    put("rl_demo/action.bin", whole(1, -1, 3, 0, 1))
    put("rl_demo/large.bin", whole(1, 1 << 30, 0, 0, 0) + whole(4, 5, 1))
    put("rl_demo/choices.bin", whole(4, -3, 1))
    put("rl_demo/nan.bin", struct.pack("<Bf4B", 0, float("nan"), 1, 0, 0, 0))
    put("rl_demo/reward.bin", struct.pack("<Bd", 2, float("inf")) + struct.pack("<Bd", 3, float("nan")))
    put("rl_demo/task.bin", whole(5, 7, 0) + whole(5, 200, 1))


def nets(folder):
    """Changes to a good network's file as fuzz_umesh_net.c and fuzz_banet_net.c read them: eight bytes each."""
    def byte(place, value):
        return struct.pack("<BHB4x", 1, place, value)

    def real(place, value):
        return struct.pack("<BHxf", 0, place, value)

    put(folder + "/none.bin", b"")
    put(folder + "/text.txt", "not a network")
    put(folder + "/quote.bin", byte(1, ord("x")) + byte(20, ord("9")))
    put(folder + "/digits.bin", b"".join(byte(place, ord("7")) for place in range(60, 68)))
    put(folder + "/weights.bin", real(0, 1e30) + real(5, -1) + real(9, float("nan")))
    put(folder + "/tail.bin", b"".join(real(65535 - i, 0.5) for i in range(8)))


def png(width, height, depth, color, rows, palette=b"", interlace=0):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, depth, color, 0, 0, interlace)
    body = chunk(b"IHDR", head) + (chunk(b"PLTE", palette) if palette else b"")
    return b"\x89PNG\r\n\x1a\n" + body + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")


def pngs():
    put("png/grey.png", png(5, 4, 8, 0, bytes(b for y in range(4) for b in [y % 5, *range(y, y + 5)])))
    put("png/grey1.png", png(9, 2, 1, 0, b"\0\xaa\x80\0\x55\0"))
    put("png/rgb.png", png(3, 2, 8, 2, b"".join(b"\0" + bytes(range(20 * y, 20 * y + 9)) for y in range(2))))
    put("png/rgba.png", png(2, 2, 8, 6, b"\0" + bytes(range(8)) + b"\2" + bytes(range(8))))
    put("png/palette.png", png(4, 2, 2, 3, b"\0\x1b\0\xe4", palette=bytes(range(12))))
    put("png/depth.png", png(4, 3, 16, 0, b"".join(b"\0" + struct.pack(">4H", y, 1000, 2000, 65535) for y in range(3))))
    put("png/interlaced.png", png(2, 2, 8, 0, b"\0\1\0\2\0\3\4", interlace=1))
    put("png/huge.png", png(60000, 60000, 8, 2, b"\0"))
    put("png/short.png", png(50, 50, 8, 2, b"\0\1\2"))


def world_logs():
    """Logs of a world: one of every call; the target sets the hashes (0 here)."""
    pose = struct.pack("<7d", 0.1, 0.2, 0.3, 1, 0, 0, 0)
    camera = struct.pack("<ii", 4, 3) + pose + struct.pack("<12d", 0.8, 0.01, 2, *[0] * 9)
    arm = struct.pack("<d", 0.02) + pose + struct.pack("<9d", *range(6), 0.1, 0, 0.2) + struct.pack("<ii6d", 1, 1, *range(6))

    def record(kind, payload=b""):
        return struct.pack("<IIQ", kind, len(payload), 0) + payload

    def stored(plain):
        packed = zlib.compress(plain, 1)
        return struct.pack("<I", len(packed)) + packed

    def observe(what, endoscope, depth, color):
        none, rgb = struct.pack("<i", 0), struct.pack("<i", 3)
        return record(6, struct.pack("<iid", 0, what, 0.02) + struct.pack("<i", 1)
                      + arm + struct.pack("<d", 0.5) + struct.pack("<d", 0.01)
                      + (camera + rgb + stored(bytes(range(36))) if endoscope else none + none)
                      + struct.pack("<d", 0.01) + (camera if depth else none)
                      + (struct.pack("<i", 1) + stored(bytes(range(24))) if depth else none)
                      + (rgb + stored(bytes(range(36))) if color else none))

    psm = pose + struct.pack("<15d", 0.01, *[-1] * 6, *[1] * 6, -0.3, 1.4)
    head = record(0, struct.pack("<Iiii", 0x01020304, 1, 15, 1) + psm)
    calls = [record(1, struct.pack("<i", 1)), record(2, struct.pack("<ii", 0, 0) + pose + struct.pack("<d", 0.02)),
             record(2, struct.pack("<ii", -1, 5) + b"limit" + struct.pack("<i", 0) + pose + struct.pack("<d", 0.02)),
             record(3, struct.pack("<iid", 0, 0, 0.5)), record(4, struct.pack("<ii", 0, 0)),
             record(5, struct.pack("<id", 0, 0.02)), observe(1, False, False, False), observe(14, True, True, True)]
    magic = b"omentum world log 1\n"
    put("world_log/calls.log", magic + head + b"".join(calls) + record(7))
    put("world_log/pictures.log", magic + head + calls[-1] + record(7))
    put("world_log/cut.log", magic + head + calls[5])
    put("world_log/head.log", magic + record(0, struct.pack("<Iiii", 0x01020304, 2, 0, 0) + struct.pack("<i", 0)) + record(7))


def beliefs():
    """Changes of a belief's values as fuzz_retract_belief.c reads them: ten bytes each."""

    def real(which, value, place=0):
        return struct.pack("<BB", which, place) + struct.pack("<d", value)

    def whole(which, value, place=0):
        return struct.pack("<BBi", which, place, value) + bytes(4)

    put("belief/none.bin", b"")
    put("belief/place.bin", real(0, 0.01, 3) + real(0, -1e300, 7))
    put("belief/tet.bin", whole(1, 1000000, 2))
    put("belief/set.bin", whole(3, -1, 1))
    put("belief/law.bin", real(4, -5.0) + real(5, 0.5) + real(6, 0))
    put("belief/turn.bin", real(7, 3.0) + real(8, 0))


def views():
    """Messages of a view and lines of its page, as fuzz_view_messages.c and fuzz_view_line.c read them."""

    def message(kind, body):
        body = struct.pack("<I", kind) + body
        body += bytes(-len(body) % 4)
        return struct.pack("<I", len(body)) + body

    def part(number, nvert, fields):
        x = struct.pack(f"<{3 * nvert}H", *(1000 * i for i in range(3 * nvert)))
        out = struct.pack("<II6f", number, nvert, -1, -1, -1, 2, 2, 2) + x + bytes(-len(x) % 4) + struct.pack("<I", fields)
        for bit in (1, 2):
            if fields & bit:
                out += struct.pack("<f", 5.0) + bytes(range(nvert)) + bytes(-nvert % 4)
        return out

    def frame(number, *parts):
        return message(2, struct.pack("<Id5fII", number, 0.1 * number, 0.5, 0.1, 0.2, 0.001, 0.01, 1, len(parts)) + b"".join(parts))

    points = message(3, struct.pack("<II6f", 0, 2, 0, 0, 0, 1, 1, 1))
    put("view_messages/run.bin", points + frame(0, part(0, 3, 3), part(1, 2, 0)) + frame(1, part(0, 3, 3)) + frame(2)
        + message(5, struct.pack("<I3B", 3, 0, 128, 255)))
    put("view_messages/still.bin", frame(0))
    put("view_line/hand.txt", "grasp 0.01 -2e-3 0.005\nmove 0 0 0.02\nrelease\npress 0 0 0.03\nprobe 0.008\nyoung 0.5\npoisson 0.3\n"
        "law neo-hookean\nelement linear\nengine xpbd\npause\nstep\ngo\nreset\n")
    put("view_line/person.txt", "pause\ngo\nslow 0.5\nforbid 3 2\nallow 3 2\nattach 1 5\nfree 5 1\nplan\nyes\nno\nabort\n")


if __name__ == "__main__":
    views()
    beliefs()
    niftis()
    pngs()
    nrrds()
    mshes()
    vtks()
    vtus()
    clouds()
    surfaces()
    weights()
    umesh()
    banet()
    rl_demo()
    world_logs()
    nets("umesh_net")
    nets("banet_net")
