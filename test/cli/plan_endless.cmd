# omentum plan: programs without an end, with too many atoms, and that nothing can read. Memory: plan_memory.cmd.
write infinite.lp
    p(0). p(X+1) :- p(X).
$ omentum plan --roi 3,3 --program infinite.lp --time-limit 0.1
exit 1
err the time limit is reached
err-lines 1
no-out

write silent.lp
    a(1..100000). b :- a(X), a(Y), a(Z), X+Y+Z = -1.
$ omentum plan --roi 3,3 --program silent.lp --time-limit 0.1
exit 1
err the time limit is reached
err-lines 1

$ mkfifo pipe.lp; omentum plan --roi 3,3 --program pipe.lp
exit 3
err pipe\.lp: is a pipe, a file is wanted
err-lines 1

# Ctrl-C ends grounding, and nothing of the program stays behind.
$ timeout --preserve-status -s INT 0.3 omentum plan --roi 3,3 --program silent.lp
exit 130
err cancelled; nothing was written
err-lines 1
