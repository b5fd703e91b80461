# omentum study attachments: all parts, quick; the part layouts resumed, and one sentence for each mistake. Whether
# goals are met on coarse sheets is not tested.
$ omentum study attachments --quick --workers 1 -q -o all; code=$?; test $code -le 1 && cp -r all/layouts out
exit 0
out ^kidney: left out: no --volume FILE
out ^report of all parts: all/report.html
file all/report.html
file all/simulated/study.json
out ^3 layouts; medians over views:
out ^Same +DSC 1\.00, TPR 100 %, AVE +[0-9.]+ mm
out ^the goal of 0\.6 and 80 %, 0\.75 and 85 % from three views, 300 ms is (met|missed)
no-err
file out/report.html
file out/study.json
file out/vertices.csv
file out/truth-layout-01-1-12.bin

# Every number, computed anew from the vertices.
$ python3 -B $ROOT/test/study/check_match.py attachments out
exit 0
out every number agrees

# Resumed: the same vertices.
$ cp out/vertices.csv first.csv; rm -f out/layout-02-12.bin; omentum study attachments --part layouts --quick -q -o out > said; cmp first.csv out/vertices.csv
exit 0

$ omentum study attachments
exit 2
err add -o DIR

$ omentum study attachments --part kidney -o out
exit 2
err needs the labels of a CT; add --volume FILE

$ omentum study attachments --part kidney --volume none.nii.gz -o out/kidney
exit 3
err none.nii.gz: no such file

$ omentum study attachments --part kidney --volume none.nii.gz --runs 0 -o out/kidney
exit 2
err --runs: 0 is outside its range, 1 to 100

$ mkdir mine && echo 1 > mine/notes.txt && omentum study attachments --part layouts --quick -q -o mine; code=$?; ls -A mine; exit $code
exit 3
out ^notes\.txt$
err mine holds notes\.txt and no list
