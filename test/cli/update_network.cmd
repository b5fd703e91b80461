# omentum update: the network that comes along.
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

# The network that comes along is used, and attaches more than physics does. How near to the truth is held by
# test_banet_update: on this mesh, three times coarser than the bodies of training, both estimates fail.
$ omentum update free.yaml run/acquisitions/001.yaml --network none -q -o out
exit 0
$ omentum update free.yaml run/acquisitions/001.yaml --workers 2 -q -o net
exit 0
out free\.yaml: the twin takes the new attachments$
out network: 1 of 1 acquisitions; the attachments are those of
no-err
$ n() { sed -n 's/.*"attached_vertices": \([0-9]*\),/\1/p' $1/update.json; }; test $(n net) -gt $(n out) && test $(n net) -le 36
exit 0

# The same bytes with another number of workers.
$ $OMENTUM update free.yaml run/acquisitions/001.yaml --workers 1 -q -o one > /dev/null; cmp one/attachments.vtu net/attachments.vtu && echo same
exit 0
out ^same$
