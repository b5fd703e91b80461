# omentum view: what it refuses. The pages themselves are tested by test_view_server and view_browser.
copy small.yaml
$ omentum view
exit 2
err no scene is given

$ omentum view nowhere
exit 3
err nowhere

$ mkdir empty && omentum view empty
exit 3
err empty has no view.html

$ omentum view small.yaml --free --port 70000
exit 2
err --port

$ omentum view small.yaml --free --listen 0.0.0.0
exit 3
err a token is needed

# The folder of a run: its page over HTTP, until a signal ends it.
$ mkdir -p run && echo '<p>page</p>' > run/view.html && (omentum view run --port 0 > out.txt & echo $! > pid; for i in 1 2 3 4 5 6 7 8 9 10; do grep -q http out.txt && break; sleep 0.1; done; kill -INT $(cat pid); wait $(cat pid))
exit 0
$ cat out.txt
exit 0
out ^open http://127\.0\.0\.1:\d+/ in a browser; Ctrl-C ends the program$

$ omentum view --help
exit 0
out Examples:
out ssh -L
