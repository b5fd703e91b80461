# omentum model: surfaces, meshes and folders that cannot be used, one sentence each.

# A surface with a hole, one inside out.

$ printf 'OFF\n4 3 0\n0 0 0\n30 0 0\n0 30 0\n0 0 30\n3 0 2 1\n3 0 1 3\n3 0 3 2\n' > open.off; omentum model --no-bending open.off -q -o none2
exit 3
err open\.off: the surface is open: 1 hole larger than 5\.2 mm \(10 % of the body\), the largest 30 mm across, of 3 edges, around \(15, 15, 15\) mm; close it .* \(--repair\)
err-lines 1
no-file none2

$ printf 'OFF\n4 4 0\n0 0 0\n30 0 0\n0 30 0\n0 0 30\n3 0 1 2\n3 0 3 1\n3 0 2 3\n3 1 3 2\n' > inward.off; omentum model --no-bending inward.off --strict -q -o none2
exit 3
err inward\.off: the surface has 1 part inside out \(its triangles face inwards\), at .*; without --strict it is mended
no-file none2

# Not a number, inverted elements, surfaces that bound nothing: each names its file and where.
$ printf 'v 0 0 0\nv 30 0 0\nv 0 nan 0\nv 0 0 30\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n' > nan.obj; omentum model --no-bending nan.obj -q -o none2
exit 3
err nan\.obj: line 3: a coordinate is not finite
err-lines 1
no-file none2

$ printf 'v 0 0 0\nv 30 0 0\nv 0 30 0\nv 0 0 30\nf 1 3 2\nf 1 2 4\nf 1 4 9\nf 2 3 4\n' > index.obj; omentum model --no-bending index.obj -q -o none2
exit 3
err index\.obj: triangle 3 names vertex 9, the file has 4
no-file none2

$ printf 'OFF\n5 5 0\n0 0 0\n30 0 0\n0 30 0\n0 0 30\n40 40 40\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n3 0 1 4\n' > fin.off; omentum model --no-bending fin.off -q -o none2
exit 3
err fin\.off: 20 % of the triangles of the surface had to be dropped, turned or added, more than 10 %: .*--repair
err-lines 1
no-file none2
$ omentum model --no-bending fin.off --strict -q -o none2
exit 3
err fin\.off: the surface has 1 triangle of a fin or an inner wall, at \(23\.33, 13\.33, 13\.33\) mm
no-file none2
$ omentum model --no-bending fin.off --strict --repair -q -o none2
exit 2
err --repair and --strict exclude each other

$ printf '# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n0 0 0 30 0 0 0 30 0 0 0 30\nCELLS 1 5\n4 0 2 1 3\nCELL_TYPES 1\n10\n' > inverted.vtk; omentum model --no-bending inverted.vtk --strict -q -o none2
exit 3
err inverted\.vtk: tetrahedron 1 is inverted
err-lines 1
no-file none2

$ gzip -c /dev/null > empty.nii.gz; omentum model --no-bending empty.nii.gz -q -o none2
exit 3
err empty\.nii\.gz: .*too early
err-lines 1
no-file none2

# DICOM is known by its mark, also in folders of a disc; without dcm2niix the message is the command to run.
$ mkdir -p "a disc/DICOM/PAT0"; (head -c 128 /dev/zero; printf 'DICM\2\0') > "a disc/DICOM/PAT0/IM1"; PATH=/nowhere $OMENTUM model "a disc" -q -o none2
exit 3
err a disc: DICOM is read by dcm2niix, which is not installed: install the package dcm2niix, or .* with: dcm2niix -z y -f %d_%s -o \. "a disc" and give the \.nii\.gz
err-lines 1
no-file none2
$ PATH=/nowhere $OMENTUM model --list "a disc/DICOM/PAT0/IM1"
exit 3
err dcm2niix .* "a disc/DICOM/PAT0" 

$ mkdir folder; omentum model --no-bending folder -q -o none2
exit 3
err folder: its name ends in none of \.nii
no-file none2
