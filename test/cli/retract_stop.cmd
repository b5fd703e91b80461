# omentum retract: signals, and a full disk: the record so far is kept.
copy small.yaml

# A full disk, as a limit on the size of files: one sentence, and the audit, since the operation took place.
$ mkdir full && (trap '' XFSZ; ulimit -f 300; omentum retract small.yaml -q -o full/out; code=$?; ls -A full; exit $code)
exit 3
err full/out.*cannot .*: File too large
err-lines 1
out ^out-unfinished$

# Ctrl-C, SIGTERM, SIGHUP in an operation that takes 30 s by the clock: the record so far is kept, beside what stands there, and no
# temporary folder is left.
$ sed 's/speed_mm_s:.*/speed_mm_s: 0.1/' small.yaml > slow.yaml; mkdir int && (omentum retract slow.yaml -q --real-time -o int/out & p=$!; while ! test -s int/out-unfinished/audit.jsonl && kill -0 $p; do sleep 0.02; done; kill -INT $p; wait $p; code=$?; ls -A int; exit $code)
exit 130
out ^out$
err cancelled; the record so far is in int/out$
err-lines 1
file int/out/report.html
$ (omentum retract slow.yaml -q --real-time -o int/out & p=$!; while ! test -s int/out-unfinished/audit.jsonl && kill -0 $p; do sleep 0.02; done; kill -HUP $p; wait $p; code=$?; ls -A int | tr '\n' ' '; exit $code)
exit 130
out ^out out\.new-[0-9a-f]{8} $
err cancelled; the record so far is in int/out\.new-[0-9a-f]{8}$

# The same wish sent twice, as timeout and shells do, is one wish.
$ mkdir twice && (omentum retract slow.yaml -q --real-time -o twice/out 2> /dev/null & p=$!; while ! test -s twice/out-unfinished/audit.jsonl && kill -0 $p; do sleep 0.02; done; kill -TERM $p; kill -TERM $p; sleep 0.01; kill -TERM $p; wait $p; code=$?; ls -A twice; exit $code)
exit 130
out ^out$
file twice/out/run.json
