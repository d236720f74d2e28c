# Names printed against names documented:  awk -f names.awk PRINTED KNOWN NEW
#
# Every name printed is known (or new), every new one is printed. Words in capitals stand for any
# name.
function pattern(name) {
    gsub(/[][().*+?^$|\\]/, "\\\\&", name)
    gsub(/[A-Z][A-Z][A-Z]+/, "[^@/.,]+", name)
    return "^" name "$"
}

FILENAME == ARGV[1] { printed[$0]; next }
{ known[$0] = pattern($0) }
FILENAME == ARGV[3] { fresh[$0] }
END {
    for (name in printed) {
        found = 0
        for (other in known) if (name ~ known[other]) { found = 1; used[other] }
        if (!found) { print "printed, but not in the document: " name; wrong = 1 }
    }
    for (name in fresh) if (!(name in used)) { print "in the document, but not printed: " name; wrong = 1 }
    exit wrong
}
