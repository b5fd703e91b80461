# omentum calibrate: from an experiment that is planned to a calibrated scene, and one sentence for whatever goes
# wrong.
write strip.yaml
    name: strip
    tissue:
      source: sheet
      size_mm: [60, 30, 10]
      cells: [6, 3, 1]
      element: linear
      world_cells: [9, 5, 2]
      young: 3000
      poisson: 0.3
      rayleigh_stiffness: 0
    attachments: {kind: box, lo_mm: [-31, -16, -1], hi_mm: [-20, 16, 1]}
    roi: {random: false, center_mm: [0, 0, 5], radius_mm: 3}
    world: {young_factor: 1}
write lift.yaml
    title: A strip lifted at its end
    scene: strip.yaml
    observations: seen.csv
    parameters:
      - {name: tissue.young, min: 500, max: 50000, start: 2000, log: true}
    paths:
      - name: end
        kind: lift
        point_mm: [30, 0, 10]
        direction: [0, 0, 1]
        grasp_radius_mm: 12
        speed_mm_s: 10
        time_step_s: 0.1
        settle_s: 0.5
    search: {noise_mm: 0.5, force_mm_per_n: 50, generations: 2, population: 5, tolerance: 0.02}
write seen.csv
    experiment,level_mm,landmark,x_mm,y_mm,z_mm
    # what is to be seen; --synthetic fills in where
    end,rest,middle,5,0,5
    end,10,middle,0,0,0
    end,20,middle,0,0,0
    end,20,force,0,0,0

$ sed 's/,5,0,5$/,0,0,0/' seen.csv > plan.csv; omentum calibrate lift.yaml --observations plan.csv -q -o planned; code=$?; test ! -e planned && exit $code
exit 3
err plan\.csv: all 3 observations are 0, as in a plan of what is to be observed; --synthetic FILE

$ omentum calibrate lift.yaml --synthetic seen2.csv --set tissue.young=6000
exit 0
out ^synthetic observations: seen2.csv
no-err
file seen2.csv

$ omentum calibrate lift.yaml --observations seen2.csv -q -o out
exit 0
out ^calibrated: error .* mm at the start
out ^tissue.young: [4-8][0-9][0-9][0-9]
out of this mesh; .* with its error
out ^note: these values hold for this mesh: with a mesh 1\.\d times finer
no-err
file out/report.html
file out/calibration.json
file out/calibrated.yaml
file out/journal.jsonl

$ grep -o 'class="verdict [a-z]*"' out/report.html; grep -c 'determined, of this mesh' out/report.html; grep -c '"is_of_this_mesh": true' out/calibration.json; head -1 out/calibrated.yaml
exit 0
out verdict bad
out values of the mesh they were found with

$ mv seen2.csv seen.csv && omentum calibrate lift.yaml -q -o out
exit 0
out evaluations \(0 new\)

# What the problem reads is never written; a file of measured values is not replaced, one of ours is.
$ for f in lift.yaml strip.yaml seen.csv; do cp $f kept; omentum calibrate lift.yaml --synthetic $f; test $? -eq 3 && cmp kept $f || exit 1; done
exit 0
err seen\.csv is an input and cannot be the output too
err lift\.yaml exists and was not written by omentum, or was changed since
$ ln seen.csv other.csv; omentum calibrate lift.yaml --synthetic other.csv
exit 3
err is an input and cannot be the output too
$ rm other.csv; grep -v seal seen.csv > measured.csv; cp measured.csv kept; omentum calibrate lift.yaml --synthetic measured.csv; code=$?; cmp kept measured.csv && exit $code
exit 3
err measured\.csv exists and was not written by omentum, or was changed since; name another file, or move it away
$ for i in 1 2; do $OMENTUM calibrate lift.yaml --synthetic again.csv || exit 1; done
exit 0
$ omentum calibrate lift.yaml --synthetic /dev/full; code=$?; test -c /dev/full && exit $code
exit 3
err /dev/full: cannot write: No space left on device
err-lines 1
$ omentum calibrate lift.yaml --synthetic /dev/stdout > through.csv; grep -c , through.csv
exit 0
out ^[5-9]$

# A journal of somebody else, linked or not, is not cut; a folder of theirs is not used.
$ mkdir theirs && printf 'mine' > theirs/journal.jsonl && omentum calibrate lift.yaml -q -o theirs; code=$?; cat theirs/journal.jsonl; exit $code
exit 3
out ^mine$
err theirs holds journal\.jsonl and no list
$ mkdir linked && cp out/.om* linked && printf 'mine' > far.txt && ln -s ../far.txt linked/journal.jsonl && omentum calibrate lift.yaml -q -o linked; code=$?; cat far.txt; exit $code
exit 3
out ^mine$
err linked/journal\.jsonl: is a link
$ rm linked/journal.jsonl && ln far.txt linked/journal.jsonl && omentum calibrate lift.yaml -q -o linked; code=$?; cat far.txt; exit $code
exit 3
out ^mine$
err linked/journal\.jsonl: is a file with two names
$ rm far.txt && omentum calibrate lift.yaml -q -o linked; code=$?; cat linked/journal.jsonl; exit $code
exit 3
out ^mine$
err linked/journal\.jsonl: its last line is not of a journal
$ cp -r out told && echo changed >> told/calibrated.yaml && omentum calibrate lift.yaml -q -o told
exit 3
err told/calibrated\.yaml was changed after omentum wrote it

# A cloud is what the scene's depth camera sees.
$ (head -1 seen.csv; echo end,20,cloud,0,0,0) > plan.csv && omentum calibrate lift.yaml --observations plan.csv --synthetic cloud.csv && echo points $(grep -c ^end,20,cloud cloud.csv)
exit 0
out ^points [1-9][0-9]
no-err

# Again: nothing is evaluated; other workers: the same journal.
$ omentum calibrate lift.yaml -q -o out
exit 0
out evaluations \(0 new\)

$ omentum calibrate lift.yaml -q -o two --workers 2 && cmp out/journal.jsonl two/journal.jsonl && cmp out/report.html two/report.html
exit 0

# Killed and started again.
$ head -c 900 out/journal.jsonl > cut && rm -rf out2 && mkdir out2 && cp out/.om* out2 && mv cut out2/journal.jsonl && omentum calibrate lift.yaml -q -o out2 && cmp out/journal.jsonl out2/journal.jsonl && cmp out/calibration.json out2/calibration.json
exit 0

# The scene takes what was found.
$ printf 'calibrated: out/calibrated.yaml\n' >> strip.yaml && sed -i 's/start: 2000, //' lift.yaml && omentum calibrate lift.yaml -q -o four
exit 0
out ^tissue.young: .*start [4-8][0-9][0-9][0-9]

$ printf 'tissue:\n  yuong: 3\n' > out/calibrated.yaml && omentum calibrate lift.yaml -q -o four
exit 3
err out/calibrated.yaml:2: tissue: unknown key "yuong"; did you mean "young"
err-lines 1

$ sed -i '/^calibrated/d' strip.yaml && omentum calibrate lift.yaml -q -o two --seed 2
exit 3
err two/journal.jsonl: the journal of another problem
err-lines 1

# What is wrong with a problem.
$ sed 's/tissue.young/tissue.yung/' lift.yaml > bad.yaml; omentum calibrate bad.yaml -q -o bad
exit 3
err bad.yaml:5: name: "tissue.yung" is none of
err-lines 1

$ sed 's/end,10,middle/ends,10,middle/' seen.csv > bad.csv; sed 's/seen.csv/bad.csv/' lift.yaml > bad.yaml; omentum calibrate bad.yaml -q -o bad
exit 3
err bad.csv:3: experiment: no path "ends"; did you mean "end"
err-lines 1

$ sed 's/end,20,force/end,20,tip/' seen.csv > bad.csv; omentum calibrate bad.yaml -q -o bad
exit 3
err bad.csv:5: landmark: the position of "tip" at rest is missing
err-lines 1

$ sed 's/end,10,middle,/end,10,middle,x/' seen.csv > bad.csv; omentum calibrate bad.yaml -q -o bad
exit 3
err bad.csv:3: x_mm: "x.*" is not a number
err-lines 1

$ sed 's/30, 0, 10/90, 0, 10/' lift.yaml > bad.yaml; omentum calibrate bad.yaml -q -o bad
exit 3
err path end: .*
err-lines 1

$ sed 's/min: 500/min: 9000/' lift.yaml > bad.yaml; omentum calibrate bad.yaml -q -o bad
exit 3
err tissue.young: the scene's value .* is outside
err-lines 1

$ omentum calibrate lift.yaml
exit 2
err add -o DIR

$ omentum calibrate lift.yaml --synthetic a.csv --set tissue.yung=3
exit 3
err did you mean tissue.young

$ omentum calibrate none.yaml -o x
exit 3
err none.yaml
