# omentum retract: wrong input, one sentence each.
copy small.yaml

# A ROI that the picture does not hold.
$ sed 's/fov_deg: 60/fov_deg: 18/' small.yaml > narrow.yaml && omentum retract narrow.yaml -q -o narrow
exit 3
err narrow\.yaml: endoscope: with the tissue removed it sees \d+ % of the ROI.*outside the picture.*fov_deg or distance_mm
err-lines 1
no-file narrow

# Wrong input.
$ omentum retract none.yaml -o out
exit 3
err none\.yaml: .*[Nn]o such file
err-lines 1

$ sed 's/force_threshold/force_treshold/' small.yaml > typo.yaml && omentum retract typo.yaml -o out
exit 3
err typo\.yaml:16: .*"force_treshold".*did you mean "force_threshold"
err-lines 1
no-file out

$ sed 's/grasp_radius_mm: .*/grasp_radius_mm: wide/' small.yaml > type.yaml && omentum retract type.yaml -o out
exit 3
err type\.yaml:17
err-lines 1

$ sed 's/center_mm:.*/center_mm: [-400, 0, 0]/' small.yaml > far.yaml && omentum retract far.yaml -q -o out
exit 3
err far\.yaml: roi: center_mm .* is not under the tissue
err-lines 1
no-file out

$ omentum retract $ROOT/scenes/kidney.yaml --data . -q -o out
exit 3
err ct_abdomen/labels\.nii\.gz: no such file.*--data
err-lines 1
no-file out

$ omentum retract small.yaml
exit 2
err add -o DIR

$ omentum search small.yaml --update
exit 2
err --update

# Options that are commands now.
$ omentum retract small.yaml --search
exit 2
err --search is a command of its own: omentum search SCENE.yaml
$ omentum retract small.yaml --layouts=3 -o out
exit 2
err omentum layouts SCENE.yaml --count N -o DIR
$ omentum retract --replay run
exit 2
err omentum replay DIR
$ omentum retract small.yaml --calibrate-force
exit 2
err omentum calibrate-force SCENE.yaml
$ omentum retract small.yaml --calibrate-mesh
exit 2
err omentum retract: --calibrate-mesh is gone: .*`element: quadratic`.*delete `mesh_factor`
$ omentum calibrate-mesh small.yaml
exit 2
err omentum: calibrate-mesh is gone: .*`element: quadratic`.*delete `mesh_factor`

$ omentum retract -o out
exit 2
err no scene is given

$ omentum retract small.yaml -o out --layuot 3
exit 2
err did you mean --layout

$ omentum retract small.yaml -q -o out --program none.lp
exit 3
err none\.lp
no-file out

$ printf 'a :- b, .\n' > bad.lp; omentum retract small.yaml -q -o out --program bad.lp
exit 3
err bad\.lp:1
no-file out

$ touch taken && omentum retract small.yaml -q -o taken/out
exit 3
err taken
err-lines 1

$ omentum retract --help
exit 0
out Examples:
