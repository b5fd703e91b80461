# omentum plan: plans, reasons, and what is said about wrong input.
$ omentum plan --roi 3,3 --attached 3,3 --attached 2,3
exit 0
out ^1\. PSM1 reaches grasping point \(3,2\)$
out ^7\. PSM1 pulls \(3,2\) up$
no-err

$ omentum plan --roi 3,3 --attached 3,3 --tried 3,2 --why
exit 0
out \(3,3\): forbidden: it is above attachment points
out \(3,2\): forbidden: it was grasped before
out allowed, but it is 9\.9 mm farther from the region of interest

$ omentum plan --roi 2,2 --json
exit 0
out "verb": "move_away"|"verb": "pull"
out "is_optimal": true

$ omentum plan --example > situation.yaml
exit 0
$ omentum plan situation.yaml --why
exit 0
out ^1\. PSM1 folds \(3,3\) towards the region of interest$
out to pull: forbidden: the arm is at its height limit

# no plan is an answer
$ omentum plan --grid 1 --roi 1,1 --attached 1,1
exit 1
out ^No plan exposes the region of interest
out Grasping \(1,1\): forbidden, since it is above attachment points
no-err

# a program of one's own
write own.lp
    #program base.
    a(X :- b(X).
$ omentum plan --roi 1,1 --program own.lp
exit 3
err own\.lp:2:5-7: error: syntax error
err-lines 1
no-out

$ omentum plan --print-program > mine.lp
exit 0
$ omentum plan --roi 3,3 --program mine.lp
exit 0
out ^1\. PSM1 reaches grasping point \(3,3\)$

$ omentum plan --roi 1,1 --program absent.lp
exit 3
err absent\.lp: no such logic program
err-lines 1

# wrong input
$ omentum plan
exit 3
err no situation is given: add a file .* or --roi
err-lines 1

$ omentum plan --roi 3,9
exit 3
err option --roi: block \(3,9\) is outside of the grid of 5
err-lines 1

$ omentum plan --roi 3
exit 3
err option --roi: "3" is not a block
err-lines 1

$ omentum plan --roi 3,3 --horizen 12
exit 2
err did you mean --horizon
err-lines 1

write wrong.yaml
    grid: 2
    tissue: |
      . R
      . Z
$ omentum plan wrong.yaml
exit 3
err wrong\.yaml: tissue: "Z" in row 2, column 2
err-lines 1

write key.yaml
    grid: 2
    tisue: ". R . ."
$ omentum plan key.yaml
exit 3
err key\.yaml:2: .*tissue
err-lines 1

write arm.yaml
    grid: 2
    tissue: ". R . ."
    psm1: {holds: true}
$ omentum plan arm.yaml
exit 3
err psm1: holds needs x and y
err-lines 1
