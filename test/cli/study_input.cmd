# omentum study: one sentence for whatever goes wrong before a study begins. The studies themselves:
# study_learning.cmd and the slow tests of their names.
$ mkdir mine && echo 1 > mine/notes.txt
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

$ omentum study attachments --part layouts --quick -q -o mine; code=$?; ls -A mine; exit $code
exit 3
out ^notes\.txt$
err mine holds notes\.txt and no list

$ omentum study attachments --part simulate -o out
exit 2
err --part: "simulate" is none of layouts, simulated, phantoms, kidney

$ omentum study attachments --part simulated --samples 0 -o out
exit 2
err --samples

$ omentum study correspondence
exit 2
err add -o DIR

$ omentum study correspondence -o out --spacing 1
exit 2
err --spacing

$ omentum study correspondence --quick -q -o mine; code=$?; ls -A mine; exit $code
exit 3
out ^notes\.txt$
err mine holds notes\.txt and no list

$ omentum study sheet-calibration --quick -q -o mine; code=$?; ls -A mine; exit $code
exit 3
out ^notes\.txt$
err mine holds notes\.txt and no list

$ omentum study sheet-calibration
exit 2
err add -o DIR

$ omentum study sheet-calibration -o out --leave-one-outt
exit 2
err --leave-one-out

$ omentum study retraction --part kidney -q -o out
exit 3
err needs data

$ omentum study retraction --part kidneys -o out
exit 2
err did you mean kidney

$ omentum study retraction
exit 2
err add -o DIR

$ omentum study retraction --part scenarios --seed development -q -o out
exit 3
err only random pairs, their ablations and alarms

$ omentum study retraction --part random --seed HEAD -o out
exit 2
err none of development, here, a commit

$ omentum study trust
exit 2
err add -o DIR

$ omentum study trust --truths 0 -o out
exit 2
err --truths

$ omentum study trust --seed HEAD -o out
exit 2
err none of development, here, a commit

$ omentum study trust --quick -q -o mine; code=$?; ls -A mine; exit $code
exit 3
out ^notes\.txt$
err mine holds notes\.txt and no list

$ omentum study contact --quick -q -o mine; code=$?; ls -A mine; exit $code
exit 3
out ^notes\.txt$
err mine holds notes\.txt and no list

$ omentum study calibration --quick -q -o mine
exit 3
err mine holds notes\.txt and no list

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

$ omentum study contact -o out --tune-on 1
exit 2
err unknown option --tune-on

$ omentum study curve -o out
exit 2
err -d DATA

$ mkdir none; omentum study curve -d none -o out --sizes 10
exit 3
err none: no file of samples

$ omentum study curve -d none -o none
exit 3
err none is an input and cannot be the output too

# a program without its weights says so before it plans
$ mkdir alone; cp $OMENTUM alone/program; cp "$(dirname $OMENTUM)"/../libomentum.so.0.2 alone 2> /dev/null; cd alone; LD_LIBRARY_PATH=. ./program study retraction --quick -o out
exit 3
err ^omentum study: no trained BA-Net: weights/banet.safetensors is not installed
no-file alone/out/report.html
