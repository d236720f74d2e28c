# What a document shows against what was printed:  awk -f compare.awk PRINTED SHOWN
#
# Every line shown is found among those printed, from where the last was on. Words are compared as
# they are, numbers to the digits shown; "..." is any word, and, alone on a line, any lines.
function number(word) { return word ~ /^[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?$/ }

function last_digit(word,   part, exponent) { # what one unit of it is worth
    split(tolower(word), part, "e")
    exponent = part[2] + 0
    if (sub(/.*\./, "", part[1])) exponent -= length(part[1])
    return 10 ^ exponent
}

function distance(a, b) { return a > b ? a - b : b - a }

# Brackets, commas and the like around numbers are the same on both sides.
function same_word(a, b) {
    if (a ~ /^\.\.\.[,;:)]?$/ || a == b) return 1
    while (a !~ /^[-+.0-9]/ && a != "" && substr(a, 1, 1) == substr(b, 1, 1)) { a = substr(a, 2); b = substr(b, 2) }
    while (a !~ /[.0-9]$/ && a != "" && substr(a, length(a)) == substr(b, length(b))) {
        a = substr(a, 1, length(a) - 1); b = substr(b, 1, length(b) - 1)
    }
    return number(a) && number(b) && distance(a + 0, b + 0) <= 0.5001 * last_digit(a)
}

function same_line(a, b,   n, i, words, others) {
    n = split(a, words)
    if (n != split(b, others)) return 0
    for (i = 1; i <= n; i++) if (!same_word(words[i], others[i])) return 0
    return 1
}

FILENAME == ARGV[1] { printed[++lines] = $0; next }
NF == 0 || $0 == "..." { next }
{
    while (++at <= lines && !same_line($0, printed[at])) ;
    if (at > lines) { print "not printed: " $0; exit 1 }
}
