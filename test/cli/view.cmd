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
err empty has neither view.html nor patient.yaml

$ omentum view small.yaml --free --port 70000
exit 2
err --port

$ omentum view small.yaml --free --listen 0.0.0.0
exit 3
err a token is needed

# A mesh or a patient model needs no scene, and no robot.
write one.vtk
    # vtk DataFile Version 3.0
    one
    ASCII
    DATASET UNSTRUCTURED_GRID
    POINTS 4 double
    0 0 0 50 0 0 0 50 0 0 0 50
    CELLS 1 5
    4 0 1 2 3
    CELL_TYPES 1
    10
write ball.stl
    solid
$ omentum view one.vtk --unit furlong
exit 3
err furlong.*mm, cm, m

$ omentum view one.vtk --up w
exit 3
err --up

$ omentum view one.vtk --defras
exit 3
err no task for a robot

$ omentum view one.vtk --layout 3
exit 3
err --layout

$ omentum view ball.stl --free
exit 3
err omentum model ball.stl

$ omentum view missing.msh
exit 3
err missing.msh

$ omentum view small.yaml --free --unit mm
exit 3
err of meshes

$ omentum view small.yaml --free -o out
exit 3
err writes nothing

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

# A robot that waits for a person on the page: the plan before is made while the page is open, and a signal ends both.
$ (sed 's/^task:/rgbd: {width: 96, height: 72}\n&/' small.yaml; echo '  grid: 2') > coarse.yaml; (omentum view coarse.yaml --defras --approve --port 0 -q > told.txt & p=$!; for i in $(seq 200); do grep -q 'plan before' told.txt && break; kill -0 $p 2> /dev/null || break; sleep 0.05; done; sleep 0.3; kill -INT $p; wait $p; echo code $?)
exit 0
out ^code (130|0)$
