# Closed and full descriptors: model and plan.
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

# Descriptors: what was written stays, and the exit code says that nothing could be printed.
$ omentum model ball.obj -e 15 -q -o full > /dev/full
exit 4
err ^omentum: standard output: cannot write: No space left on device; output files are complete$
err-lines 1
file full/patient.yaml
$ omentum model ball.obj -e 15 -q -o closed >&-
exit 4
err standard output: cannot write: Bad file descriptor
file closed/patient.yaml
$ omentum model ball.obj -e 15 -q -o none >&- 2>&- <&-
exit 4
file none/patient.yaml
$ omentum model none.obj -e 15 -q -o none2 >&- 2>&- <&-
exit 3
no-file none2
$ omentum --version > /dev/full
exit 4
err cannot write
$ omentum plan --roi 3,3 > /dev/full
exit 4
err cannot write
$ omentum plan --roi 3,3 --why | true; exit ${PIPESTATUS[0]}
exit 4
err cannot write: Broken pipe
