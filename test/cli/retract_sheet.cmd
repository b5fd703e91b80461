# The thesis's sheet over the thesis's 17 layouts: README says that all are exposed.
$ omentum layouts $ROOT/scenes/sheet.yaml -q -o sheet
exit 0
out ^[a-z-]+: 17 of 17 layouts exposed

$ grep -l '"exposed": true' sheet/layout-*/run.json | wc -l
exit 0
out ^17$
