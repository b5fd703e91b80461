# omentum retract --print-scene, --keys, --example, --dry-run: the scene as the program reads it.
copy small.yaml

# The example and the page of keys are those of the program.
$ omentum retract --keys | diff - $ROOT/doc/scene_keys.md
exit 0
no-out

$ omentum retract --example > example.yaml && $OMENTUM retract example.yaml --dry-run -q -o example
exit 0
out ^example, layout 1: the scene can be run
out twin: 578 vertices \(\d+ attached\), 1536 tetrahedra; truth: 1250 vertices
out memory: \d+ MB so far, and up to \d+ MB for the report
out time: \d+\.\d s to begin, then about \d+\.\d\d s for each second of operation
no-err
no-file example

$ sed -e 's/lo_mm:.*/lo_mm: [40, -100, -1]/' -e 's/  source: sheet/  source: sheet\n  board: false/' small.yaml > slid.yaml && omentum retract slid.yaml --dry-run -q
exit 0
out the scene can be run, but its ROI is in view before any action
out warning: \d+ % of the ROI is already visible: a run ends at once
out note: the tissue slides while it settles

$ omentum retract --example small.yaml
exit 2
err one argument too many

$ omentum retract small.yaml --dry-run -q -o small.yaml
exit 3
err small\.yaml
err-lines 1
