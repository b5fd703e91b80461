# omentum model: wrong input, one sentence each; whole or not at all.
$ (printf 'NRRD0004\ntype: uint8\ndimension: 3\nspace: right-anterior-superior\nsizes: 24 24 24\nspace directions: (3,0,0) (0,3,0) (0,0,3)\nspace origin: (-80,-35,-35)\nencoding: ascii\n\n'; awk 'BEGIN { for (k = 0; k < 24; k++) for (j = 0; j < 24; j++) for (i = 0; i < 24; i++) print ((i-11.5)^2 + (j-11.5)^2 + (k-11.5)^2 < 80) ? 7 : 0 }') > ball.nrrd
exit 0

# Wrong input: one sentence, an exit code, nothing written.
$ omentum model --no-bending ball.nrrd --label 3 -q -o none
exit 3
err no voxel has label 3; the volume holds 7
err-lines 1
no-file none

$ omentum model --no-bending missing.nii -o none
exit 3
err missing\.nii: no such file

$ omentum model --no-bending ball.nrrd --lable 7 -o none
exit 2
err did you mean --label\?

$ omentum model --no-bending ball.nrrd
exit 2
err no output folder is given; add -o DIR

$ omentum model --no-bending ball.nrrd --sheet thicknes=8 -o none
exit 2
err unknown key "thicknes"; did you mean "thickness"\?

$ omentum model --no-bending ball.nrrd --sheet thickness=8,side=anteriour -q -o none
exit 3
err did you mean "anterior"

$ omentum model --no-bending ball.nrrd --attach border -o none
exit 2
err --attach needs --sheet

$ omentum model --no-bending ball.nrrd --edge 0 -o none
exit 2
err --edge

$ omentum model --no-bending ball.nrrd --window 5,1 -q -o none
exit 3
err window: 5 to 1 is empty

$ mkdir keep && echo mine > keep/notes.txt && omentum model --no-bending ball.nrrd -q -o keep
exit 3
err keep holds notes\.txt and no list \(\.omentum\) of what omentum wrote.*name another folder
err-lines 1
file keep/notes.txt

$ touch file && omentum model --no-bending ball.nrrd -q -o file/model
exit 3
err-lines 1

$ head -c 3000 ball.nrrd > cut.nrrd && omentum model --no-bending cut.nrrd -q -o none
exit 3
err cut\.nrrd
no-file none

$ sed '/triangle/d;s/^[0-9.e+-]* [0-9.e+-]* [0-9.e+-]*$/nan 0 0/' /dev/null > empty.stl; omentum model --no-bending empty.stl -q -o none
exit 3
err empty\.stl

$ omentum model --help
exit 0
out Examples:

$ omentum model --no-bending ball.nrrd --sheet thickness=thick -o none2
exit 2
err --sheet: thickness: "thick" is not a number

$ omentum model --no-bending ball.nrrd --material young=3000,poisson=0.5 -q -o none2
exit 3
err Poisson's ratio 0.5 must be
no-file none2

# What a model takes, a simulation takes as well: its laws know no negative ratio.
$ omentum model --no-bending ball.nrrd --material young=3000,poisson=-0.2 -q -o none2
exit 3
err Poisson's ratio -0.2 must be
no-file none2

$ omentum model --no-bending ball.nrrd --edge 0.05 -q -o none2
exit 3
err million tetrahedra.*use a larger edge
no-file none2

# A folder that cannot be made; a file that cannot grow: as on a full disk; nobody reads what is printed.
$ omentum model --no-bending ball.nrrd -q -o /proc/none
exit 3
err /proc/none.*cannot make the folder
err-lines 1

$ ulimit -f 4; omentum model --no-bending ball.nrrd -e 5 -q -o none2
exit 3
err none2/.*: cannot write: File too large
err-lines 1
no-file none2
$ ls -A | grep '^\.'
exit 1

$ omentum model --no-bending ball.nrrd -e 5 -q -o told > /dev/full
exit 4
err standard output: cannot write: No space left on device; output files are complete
err-lines 1
file told/patient.yaml

# Ctrl-C: one sentence, nothing half-written, the older model as it was.
$ omentum model --no-bending ball.nrrd -l 7 -e 1.3 -q -o told & pid=$!; sleep 0.3; kill -INT $pid; wait $pid; code=$?; test -s told/patient.yaml && exit $code
exit 130
err nothing was written
