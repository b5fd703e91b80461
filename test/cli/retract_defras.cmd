# omentum retract --defras, --plan: the whole of chapter 6 on one small sheet.
copy small.yaml
$ (sed 's/^task:/rgbd: {width: 96, height: 72}\n&/' small.yaml; echo '  visibility: 0.5') > watched.yaml; (cat watched.yaml; echo '  grid: 2') > coarse.yaml
exit 0


$ omentum retract coarse.yaml -q -o run5 --defras
exit 0
out ^plan before the operation: point \(\d,\d\), PSM\d
out of the ROI exposed after
out ^  twin: at most \d+\.\d mm from the tissue in \d+ frames

# The same plan from a file; the report names where it comes from.
$ omentum preplan coarse.yaml -q -o before
exit 0
$ omentum retract coarse.yaml -q -o run6 --plan before/plan.json
exit 0
$ grep -c 'It was made before the operation' run6/report.html
exit 0
out ^1$

# An error comes before the plan, which takes a minute on a sheet of usual size.
$ (cat coarse.yaml; printf 'update:\n  network: nowhere.safetensors\n') > nonet.yaml
exit 0
$ omentum retract nonet.yaml -q -o run7 --defras
exit 3
err nowhere.safetensors: cannot open
no-out plan before the operation
