# omentum study contact: files, resuming, a body of one's own, and one sentence for whatever goes wrong.
$ omentum study contact --quick --lesions-used 1 --resolutions 623 --truth 1000 --methods penalty,prescribed --workers 1 -q -o out
exit 0
out ^2 runs \(2 new\): 2 completed the path; the worst reached 100 %
out ^all criteria are met by 2 of 2 combinations
no-err
file out/report.html
file out/study.json
file out/runs.csv
file out/errors.csv
file out/truth/lesion-01.json
file out/runs/penalty-000623-01.json

# What is finished is not done again. What was changed is not replaced; what is missing is made again.
$ cp out/report.html before.html; printf '{' > out/runs/prescribed-000623-01.json; omentum study contact --quick --lesions-used 1 --resolutions 623 --truth 1000 --methods penalty,prescribed -q -o out || (code=$?; cmp before.html out/report.html && exit $code)
exit 3
err out/runs/prescribed-000623-01\.json was changed after omentum wrote it: move it away, or name another folder$
err-lines 1

$ rm out/runs/prescribed-000623-01.json; cp out/runs/penalty-000623-01.json kept.json; omentum study contact --quick --lesions-used 1 --resolutions 623 --truth 1000 --methods penalty,prescribed -q -o out && cmp kept.json out/runs/penalty-000623-01.json
exit 0
out ^2 runs \(1 new\)

# Every number of the files, the report and the terminal, computed anew from runs and truth.
$ omentum study contact --quick --lesions-used 1 --resolutions 623 --truth 1000 --methods penalty,prescribed --workers 1 -q -o out > said && python3 -B $ROOT/test/study/check_study.py contact out said
exit 0
out every number agrees

# A path that ends early: 41 of 60 steps are 68 %, a criterion is missed, and the reason is printed.
$ python3 -B $ROOT/test/study/edit_run.py out/runs/penalty-000623-01.json stop 41 "residual 0.5" && omentum study contact --quick --lesions-used 1 --resolutions 623 --truth 1000 --methods penalty,prescribed --workers 1 -q -o out > said; code=$?; cat said out/runs.csv && python3 -B $ROOT/test/study/check_study.py contact out said && grep -c "paths that end early: 1 of 1; lesion 1 at 20.5 mm: residual 0.5" out/study.json && exit $code
exit 1
out ^2 runs \(0 new\): 1 completed the path; the worst reached 68 %
out ^all criteria are met by 1 of 2 combinations
out ^penalty,623,\d+,1,60,41,.*"residual 0.5"$
out every number agrees

# A mesh and lesions of one's own.
$ mesh=$(ls out/meshes/001000-*.vtu) && printf '# x y z radius\n0 0 50 4\n' > sites.txt && omentum study contact --quick --mesh $mesh --unit m --lesions none.txt -q -o own
exit 3
err none\.txt
err-lines 1

$ mesh=$(ls out/meshes/001000-*.vtu) && printf '0 0 1\n' > sites.txt && omentum study contact --quick --mesh $mesh --unit m --lesions sites.txt -q -o own
exit 3
err sites\.txt: none of 1 lesions is inside the body, .*units
err-lines 1

# The user's own: never replaced, never an output of what reads them.
$ mkdir mine && echo 1 > mine/report.html && omentum study contact --quick -q -o mine || (code=$?; ls -A mine; exit $code)
exit 3
out ^report\.html$
err mine holds report\.html and no list

$ omentum study calibration --quick -q -o out
exit 3
err out holds a contact study, not a calibration study

$ omentum study calibration --quick -q -o mine
exit 3
err mine holds report\.html and no list

$ mkdir sites && echo 0 0 50 > sites/s.txt && mesh=$(ls out/meshes/001000-*.vtu) && omentum study contact --quick --mesh $mesh --unit m --lesions sites/s.txt -q -o sites
exit 3
err the input sites/s\.txt lies in the output folder sites

$ omentum study methods --quick -q -o mine
exit 3
err mine holds report\.html and no list

$ omentum study contact
exit 2
err add -o DIR

$ omentum study scan -o out
exit 2
err unknown name "scan".* attachments calibration contact correspondence curve learning methods retraction sheet-calibration trust$

$ omentum study contact -o out --resolutions 12,a
exit 2
err --resolutions: "12,a"

$ omentum study contact -o out --methods springs
exit 2
err none of penalty, multipliers, prescribed

$ omentum study contact -o out --mesh a.vtu
exit 2
err go together

$ touch taken && omentum study contact --quick -q -o taken/out
exit 3
err taken
err-lines 1

$ omentum study calibration -o out --mesh a.vtu
exit 2
err unknown option --mesh

$ omentum study calibration -o out --tune-on 11
exit 2
err --tune-on

$ omentum study methods
exit 2
err add -o DIR

$ omentum study methods -o out --clusters 10,9
exit 2
err --clusters

# Weights that are not there are told before the truth is computed.
$ omentum study methods -o methods -w nowhere.safetensors -q
exit 3
err nowhere\.safetensors
err-lines 1

# Each study has options of its own; the verb lists the studies.
$ omentum study contact -o out --tune-on 1
exit 2
err unknown option --tune-on

$ omentum study --help
exit 0
out calibration
out sheet-calibration
