# The program without a verb, with a wrong one, and what every verb answers.
$ omentum --version
exit 0
out ^omentum [0-9]+\.[0-9]+\.[0-9]+$
out ^commit ([0-9a-f]{8,}(-dirty)?|unknown), compiler (gcc [0-9]|Clang|Debian Clang).*, C library 2\.[0-9]+$
out ^with(out)? parts under the GPL: 
out ^processors [1-9][0-9]*: (x86_64|aarch64)
out ^libraries cholmod 3[.0-9]*, (umfpack|superlu) [0-9.]+, .*openblas [0-9.]+
out  z 1\.[23][.0-9]*, .*nlopt 0[.0-9]*
no-err

$ omentum --help
exit 0
out ^Usage: omentum VERB
out ^  retract
no-err

$ omentum
exit 2
err ^Usage: omentum VERB
no-out

$ omentum plna
exit 2
err unknown verb "plna"; did you mean "plan"
err-lines 1
no-out

$ omentum help umesh predict
exit 0
out ^  --at X,Y,Z
out default: 15; -200 to 200 mm
no-err

$ omentum help umesh pridict
exit 2
err unknown name "pridict"; did you mean "predict"
err-lines 1
no-out

$ omentum umesh --help
exit 0
out ^  generate
out ^  predict
no-err

$ omentum help nothing
exit 2
err unknown verb "nothing"
no-out

$ omentum completion tcsh
exit 2
err bash, zsh or fish
no-out

$ omentum model --edge=3mm x.nii -o out
exit 2
err option --edge: "3mm" is not a number
no-out

$ omentum model --quiet=yes x.nii -o out
exit 2
err option --quiet takes no value
no-out

$ omentum umesh predict --press=-300
exit 2
err option --press: -300 is outside its range, -200 to 200
no-out

$ omentum model --help
exit 0
out --edge
no-err

$ omentum retract --help
exit 0
out -o
no-err

$ omentum demo --help
exit 0
out -o
no-err

$ omentum retract --nonsense
exit 2
err --nonsense
no-out
