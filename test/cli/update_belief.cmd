# omentum update: two acquisitions; a twin that believes rightly.
write small.yaml
    name: small
    tissue:
      source: sheet
      element: linear
      cells: [8, 8, 1]
      world_cells: [12, 12, 1]
    attachments:
      kind: box
      lo_mm: [10, -100, -1]
      hi_mm: [100, 100, 1]
    roi:
      random: false
      center_mm: [-40, -30, 0]

# What the run of update.cmd recorded: lifted/.
$ mkdir run && cp -r $ROOT/test/cli/lifted run/acquisitions && (cat small.yaml; echo 'believed_attachments: {kind: none}'; echo 'task: {max_actions: 4, grasp_radius_mm: 11, speed_mm_s: 200}') > free.yaml
exit 0
$ omentum update free.yaml run/acquisitions/000.yaml run/acquisitions/001.yaml --json -q -o out
exit 0
out "acquisitions": 2,
out "accepted": 1,

# A twin that believes rightly keeps its attachments.
$ sed 's/kind: none/kind: same/' free.yaml > right.yaml; $OMENTUM update right.yaml run/acquisitions/001.yaml -q -o right
exit 1
out right\.yaml: the twin keeps its attachments: the attachments that explain the scan best are those of the twin
