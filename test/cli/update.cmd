# omentum update: attachments of a twin from clouds that a run recorded.
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
# What a run recorded: tissue held on one side is lifted on the other. A twin that believes in no attachment finds some,
# by physics alone.
$ (cat small.yaml; echo 'believed_attachments: {kind: none}'; echo 'task: {max_actions: 4, grasp_radius_mm: 11, speed_mm_s: 200}') > free.yaml; $OMENTUM retract free.yaml --record-acquisitions -q -o run > /dev/null; $OMENTUM update free.yaml run/acquisitions/001.yaml --network none -q -o out
exit 0
out free\.yaml: the twin takes the new attachments$
out cloud to twin: median [0-9.]+ mm before, [0-9.]+ mm after; 90 % [0-9.]+ mm before, [0-9.]+ mm after$
out report: out/report\.html$
no-err
$ ls out && grep -c '"is_accepted": true' out/update.json && grep -o 'Name="[a-z]*"' out/attachments.vtu | sort | uniq -c
exit 0
out ^attachments\.vtu$
out ^report\.html$
out ^update\.json$
out ^1$
out Name="probability"
out Name="uncertainty"
out Name="stiffness"
out Name="attached"
out Name="displacement"
$ grep -c 'The twin takes the new attachments' out/report.html; grep -cE 'Asked: which vertices .* Came out: half of the measured points are within [0-9.]+ mm of the twin' out/report.html
exit 0
out ^1$
out ^1$
$ grep -E '"attached_vertices": [1-3][0-9],' out/update.json
exit 0
