# The program without a verb, with a wrong one, and what every verb answers.
$ omentum --version
exit 0
out ^omentum [0-9]+\.[0-9]+\.[0-9]+$
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
