# What is the user's is never lost: model, retract, demo and plan; closed and full descriptors. The cases of the
# other verbs stand with them.
write ball.obj
    v 0 0 30
    v 30 0 0
    v 0 30 0
    v -30 0 0
    v 0 -30 0
    v 0 0 -30
    f 1 2 3
    f 1 3 4
    f 1 4 5
    f 1 5 2
    f 6 3 2
    f 6 4 3
    f 6 5 4
    f 6 2 5
copy small.yaml

# Folders that only look like ours stay.
$ for d in m.old m.partial r.old r.part-1; do mkdir $d && echo mine > $d/notes.txt; done; $OMENTUM model ball.obj -e 15 -q -o m && $OMENTUM model ball.obj -e 15 -q -o m && $OMENTUM retract small.yaml -q -o r && $OMENTUM retract small.yaml -q -o r > /dev/null && cat m.old/* m.partial/* r.old/* r.part-1/* | uniq -c
exit 0
out ^ *4 mine$
no-err

# A note beside the model: the model is not replaced. Without the note it is.
$ echo mine > m/notes.txt; cp m/report.json kept; omentum model --no-bending ball.obj -e 10 -q -o m; code=$?; cmp kept m/report.json && cat m/notes.txt && exit $code
exit 3
out ^mine$
err m holds notes\.txt, which omentum did not write: move it away, or name another folder$
err-lines 1
$ rm m/notes.txt; omentum model --no-bending ball.obj -e 10 -q -o m; cmp -s kept m/report.json
exit 1

$ mkdir r/runs; omentum retract small.yaml -q -o r; code=$?; test -d r/runs && exit $code
exit 3
err r holds runs, which omentum did not write
$ rmdir r/runs; echo more >> r/run.json; omentum retract small.yaml -q -o r; code=$?; tail -1 r/run.json; exit $code
exit 3
out ^more$
err r/run\.json was changed after omentum wrote it

# A folder of an older version has no list; one kind does not replace another; nor does a run, the folder it is in.
$ cp -r m older && rm older/.om*; omentum model --no-bending ball.obj -e 15 -q -o older; code=$?; test -s older/patient.yaml && exit $code
exit 3
err older holds patient\.yaml and no list \(\.omentum\) of what omentum wrote, so nothing there is replaced: move it away
$ cp -r m m2; omentum retract small.yaml -q -o m2
exit 3
err m2 holds a patient model, not a retraction run
$ cd m; omentum model --no-bending ../ball.obj -e 15 -q -o .
exit 3
err is the folder that the program was started in

# Inputs in the output folder.
$ mkdir in && cp ball.obj in && omentum model --no-bending in/ball.obj -e 15 -q -o in; code=$?; test -s in/ball.obj && exit $code
exit 3
err the input in/ball\.obj lies in the output folder in
$ ln -s in lin; cp small.yaml in; omentum retract in/small.yaml -q -o lin; code=$?; test -s in/small.yaml && exit $code
exit 3
err the input in/small\.yaml lies in the output folder lin
$ omentum model --no-bending m/tissue.vtu --unit m -q -o m; code=$?; test -s m/tissue.vtu && exit $code
exit 3
err the input m/tissue\.vtu lies in the output folder m

# A link to a folder is followed; a file is no folder.
$ ln -s m2 lm && $OMENTUM model ball.obj -e 15 -q -o lm && test -L lm && test -s m2/patient.yaml
exit 0
$ omentum demo --quick -q -o ball.obj
exit 3
err ball\.obj: is a file, a folder is wanted
$ omentum --version > ver; mkdir omentum-demo && echo mine > omentum-demo/notes.txt; cp small.yaml kept.yaml; $OMENTUM demo --quick -q; code=$?; cat omentum-demo/notes.txt; exit $code
exit 3
out ^mine$
err omentum-demo holds notes\.txt and no list

# Killed: nothing stays for good; the next run in the place removes what is left.
$ mkdir k; timeout -s KILL 0.5 $OMENTUM retract $ROOT/scenes/sheet.yaml -q -o k/out; $OMENTUM retract small.yaml -q -o k/small > /dev/null; ls -A k
exit 0
out ^small$

$ mkdir k2; timeout -s KILL 0.5 $OMENTUM retract $ROOT/scenes/sheet.yaml -q -o k2/out; $OMENTUM rl eval -t reach --expert -n 1 -q -o k2/table.csv > /dev/null; ls -A k2
exit 0
out ^table\.csv$

$ cmp kept.yaml small.yaml
exit 0
