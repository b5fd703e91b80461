# omentum model: a DICOM series by dcm2niix. Here it is a script, which writes what the case says; the arguments are a vector.
$ mkdir bin series tmp; (head -c 128 /dev/zero; printf 'DICM\2\0\2\0UI\32\0001.2.840.10008.5.1.4.1.1.2\0') > series/IM1; cp -r series "two \$(touch owned) words"; cp -r series ./-b
exit 0

# An ellipsoid of label 7 in voxels of 3 mm, as NIfTI-1.
write fake.py
    import os, struct, sys
    out = sys.argv[sys.argv.index("-o") + 1]
    print("Chris Rorden's dcm2niiX version v1.0")
    print("asked for", sys.argv[1:-1][:6], sys.argv[-1])
    head = bytearray(352)
    struct.pack_into("<i", head, 0, 348)
    struct.pack_into("<8h", head, 40, 3, 24, 24, 24, 1, 1, 1, 1)
    struct.pack_into("<2h", head, 70, 2, 8)
    struct.pack_into("<8f", head, 76, 1, 3, 3, 3, 0, 0, 0, 0)
    struct.pack_into("<f", head, 108, 352)
    head[123] = 2
    struct.pack_into("<2h", head, 252, 0, 1)
    struct.pack_into("<12f", head, 280, 3, 0, 0, 0, 0, 3, 0, 0, 0, 0, 3, 0)
    head[344:348] = b"n+1\0"
    c = range(24)
    body = bytes(7 if (i - 11.5) ** 2 + (j - 11.5) ** 2 + (k - 11.5) ** 2 < 80 else 0 for k in c for j in c for i in c)
    for name in os.environ.get("WRITES", "3_ct").split():
        if name != "none":
            open(os.path.join(out, name + ".nii"), "wb").write(head + body)
    os.symlink("/etc/passwd", os.path.join(out, "link.nii"))
    if os.environ.get("FAILS"):
        sys.exit("\033[31mError: no slices\nerror: missing images")
$ (echo "#!$(command -v python3)"; cat fake.py) > bin/dcm2niix; chmod +x bin/dcm2niix
exit 0

$ PATH="$PWD/bin:$PATH" TMPDIR="$PWD/tmp" $OMENTUM model series --no-bending --edge 6 -q -o model && test -z "$(ls tmp)"
exit 0
out dcm2niix: Chris Rorden's dcm2niiX version
out dcm2niix: asked for \['-b', 'n', '-z', 'n', '-f', '%s_%d'\] series
out label 7: 3\d\d\d? voxels of 3 x 3 x 3 mm
file model/patient.yaml

# A file of the series, a name with letters of the shell, and one that looks like an option.
$ export PATH="$PWD/bin:$PATH" TMPDIR="$PWD/tmp"; $OMENTUM model --list series/IM1 && $OMENTUM model --list 'two $(touch owned) words' && $OMENTUM model --list ./-b && test -z "$(ls tmp)"
exit 0
out dcm2niix: asked for .* series/IM1
out dcm2niix: asked for .* two \$\(touch owned\) words
out ^ *7 +3\d\d\d? 
no-file owned

# What it wrote: corrected volumes go before the first ones; several series, none, and its errors.
$ export PATH="$PWD/bin:$PATH" TMPDIR="$PWD/tmp"; WRITES="3_ct 3_ct_Tilt_1 3_ct_Tilt_Eq_1" $OMENTUM model --list series
exit 0
out 3_ct_Tilt_Eq_1\.nii: 24 x 24 x 24

$ export PATH="$PWD/bin:$PATH" TMPDIR="$PWD/tmp"; WRITES="2_scout 3_ct" $OMENTUM model --list series; code=$?; test -z "$(ls tmp)" || echo left; exit $code
exit 3
err series holds several series \(number_description\): 2_scout, 3_ct: put one into a folder of its own

$ export PATH="$PWD/bin:$PATH" TMPDIR="$PWD/tmp"; WRITES=none $OMENTUM model --list series; code=$?; test -z "$(ls tmp)" || echo left; exit $code
exit 3
err series: dcm2niix wrote no volume: asked for

$ export PATH="$PWD/bin:$PATH" TMPDIR="$PWD/tmp"; FAILS=1 $OMENTUM model --list series; code=$?; test -z "$(ls tmp)" || echo left; exit $code
exit 3
out dcm2niix:  \[31mError: no slices
err series: dcm2niix failed \(code 1\): error: missing images

# Segmentations and contours are refused with the remedy, and nothing is run; beside images they do not count.
$ (head -c 128 /dev/zero; printf 'DICM\2\0\2\0UI\34\0001.2.840.10008.5.1.4.1.1.66.4\0') > seg.dcm; PATH="$PWD/bin:$PATH" $OMENTUM model seg.dcm -q -o none
exit 3
err seg\.dcm: a DICOM segmentation \(DICOM-SEG\) is not read: convert it with segimage2itkimage .*dcmqi.*3D Slicer .*\.seg\.nrrd
err-lines 1
no-out
$ (head -c 128 /dev/zero; printf 'DICM\2\0\2\0UI\36\0001.2.840.10008.5.1.4.1.1.481.3\0') > contours.dcm; $OMENTUM model contours.dcm -q -o none
exit 3
err contours\.dcm: DICOM contours \(RTSTRUCT\) are not read
err-lines 1
$ cp seg.dcm series; PATH="$PWD/bin:$PATH" $OMENTUM model --list series
exit 0
out dcm2niix: 

# Cut behind the mark, in the tag, and with a length behind the end: images, of which dcm2niix says the rest.
$ export PATH="$PWD/bin:$PATH"; for n in 132 138 140 150; do head -c $n seg.dcm > cut.dcm; $OMENTUM model --list cut.dcm || exit 1; done
exit 0
