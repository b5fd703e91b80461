# omentum retract: engines and laws of the twin, and what is refused.
copy small.yaml

# The report names the law that was used.
$ sed 's/  source: sheet/  source: sheet\n  law: stable-neo-hookean/' small.yaml > law.yaml && omentum retract law.yaml -q -o law
exit 0
out ^small, layout 1: (8\d|9\d|100) % of the ROI exposed

$ grep -c 'Twin: .* finite elements, stable-neo-hookean' law/report.html && ! grep -q 'finite elements, stable-neo-hookean' run/report.html
exit 0
out ^1$

# A twin of particles has no forces in newtons: it is refused unless the scene does without them.
$ sed -e 's/  source: sheet/  source: sheet\n  engine: pbd/' small.yaml > blind.yaml && omentum retract blind.yaml -q -o blind
exit 3
err engine "pbd" has no forces in newtons.*watch_force: false.*fem, xpbd, springs
err-lines 1

$ omentum calibrate-force blind.yaml -q --count 1
exit 3
err engine "pbd" has no forces in newtons to calibrate

$ sed -e 's/  source: sheet/  source: sheet\n  engine: pbd/' -e 's/task:/task:\n  watch_force: false/' -e 's/ cells: .*/ cells: [16, 16, 1]/' -e 's/world_cells: .*/world_cells: [24, 24, 1]/' small.yaml > pbd.yaml && omentum retract pbd.yaml -q -o pbd; test $? -le 1
exit 0
out ^small, layout 1: \d+ % of the ROI exposed after \d+ actions
out ^  pull on the tissue: not known to the twin, whose engine pbd has no forces, \d\.\d\d N in the simulated truth$
out ^  limit: none; the scene says watch_force: false$
file pbd/report.html

$ grep -c '"force_watched": false' pbd/run.json; grep -c '"force_max_n": null' pbd/run.json | grep -c -v '^0'; grep -c 'not watched: the arms do not stop for force' pbd/report.html
exit 0
out ^1$

$ grep -c 'Twin: .* particles in clusters.*Simulated truth: .* finite elements, neo-hookean' pbd/report.html
exit 0

# A twin of springs, and one of links.
$ sed -e 's/  source: sheet/  source: sheet\n  engine: springs/' small.yaml > springs.yaml && omentum retract springs.yaml -q -o springs; test $? -le 1
exit 0
out ^small, layout 1: \d+ % of the ROI exposed after \d+ actions
file springs/report.html

$ sed -e 's/  source: sheet/  source: sheet\n  engine: chainmail/' -e 's/task:/task:\n  watch_force: false/' small.yaml > mail.yaml && omentum retract mail.yaml -q -o mail; test $? -le 1
exit 0
out ^small, layout 1: \d+ % of the ROI exposed after \d+ actions
file mail/report.html

$ sed 's/  source: sheet/  source: sheet\n  engine: xpdb/' small.yaml > xpdb.yaml && omentum retract xpdb.yaml -o xpdb
exit 3
err xpdb.yaml: tissue: engine "xpdb" is not known; did you mean "xpbd"\?; engines: fem, pbd, xpbd, springs, chainmail, umesh
err-lines 1

# The key's name of before.
$ sed 's/  source: sheet/  source: sheet\n  model: pbd/' small.yaml > old.yaml && omentum retract old.yaml -o old
exit 3
err tissue: key "model" is now "engine"
err-lines 1

# An engine that needs a file, and one that takes none; a file that is no network.
$ sed -e 's/  source: sheet/  source: sheet\n  engine: umesh/' -e 's/task:/task:\n  watch_force: false/' small.yaml > net.yaml && omentum retract net.yaml -o net
exit 3
err net.yaml: tissue: engine umesh needs a file; name it by the key weights
err-lines 1

$ sed 's/  source: sheet/  source: sheet\n  weights: net.yaml/' small.yaml > file.yaml && omentum retract file.yaml -o file
exit 3
err file.yaml: tissue: engine fem reads no file; remove the key weights
err-lines 1

$ sed -e 's/  source: sheet/  source: sheet\n  engine: umesh\n  weights: small.yaml/' -e 's/task:/task:\n  watch_force: false/' small.yaml > text.yaml && omentum retract text.yaml -q -o text
exit 3
err small.yaml
err-lines 1
