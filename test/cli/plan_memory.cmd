# A program that needs too much memory for its atoms ends with a sentence. Not under sanitizers: their shadow memory fits
# no limit.
write large.lp
    p(0). p(f(X)) :- p(X).
$ omentum plan --roi 3,3 --program large.lp --time-limit 60 --memory-limit 60
exit 3
err more than 60 MB: .*--memory-limit
err-lines 1
no-out
