# Each scene that a command writes can be run again, from another folder: of a run beside its data, as the demo writes
# it, also after both have moved; of a run elsewhere; of --print-scene.
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
write scene.yaml
    name: ball
    data_root: model
    tissue: {source: mesh, unit_mm: 1000, file: tissue.vtu, element: linear, view: [0, -1, 0]}
    attachments: {kind: box, lo_mm: [-100, -100, -100], hi_mm: [-5, 100, 100]}
    roi: {random: false, center_mm: [15, 0, 0], radius_mm: 2}
    endoscope: {distance_mm: 200, elevation_deg: 45, fov_deg: 60, width: 80, height: 60}
    task: {force_threshold: 3, grasp_radius_mm: 15, speed_mm_s: 200, grid: 3, max_actions: 1}

# Data in place/model, which stays; data in case/model, which moves with the record beside it.
$ mkdir place case out && cp scene.yaml place && (omentum model --no-bending ball.obj -e 15 -q -o place/model; cp -r place/model case; grep -v data_root scene.yaml | sed 's,tissue.vtu,model/tissue.vtu,' > case/scene.yaml) > /dev/null
exit 0

$ cd place; omentum retract scene.yaml -q -o ../out/run > /dev/null; $OMENTUM retract scene.yaml --print-scene > ../out/printed.yaml; cd ..; $OMENTUM retract case/scene.yaml -q --record -o case/run > /dev/null; ls case/run/scene.yaml out/run/scene.yaml
exit 0
no-err

$ mv case elsewhere && mkdir other && cd other && bad=0; for f in $(cd ..; find elsewhere out -name '*.yaml' | xargs grep -l '^tissue:' | sort); do $OMENTUM retract ../$f --dry-run -q > said 2>&1 && echo "$f yes" || { echo "$f no"; cat said; bad=1; }; done; exit $bad
exit 0
out ^elsewhere/run/scene\.yaml yes$
out ^elsewhere/run/belief\.yaml yes$
out ^out/run/scene\.yaml yes$
out ^out/run/belief\.yaml yes$
out ^out/printed\.yaml yes$
no-err
