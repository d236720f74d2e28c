# From headers: a C file that puts a function __wrap_NAME around each one that returns a status and takes
# an error last (calls.h). One that takes a function without a type of its own is left out.
function look(    name, args, n, k, part, names) {
    if (text !~ /^enum ad_status [a-z0-9_]+\([^()]*struct ad_error \*(error|e)\);$/) return
    args = text
    sub(/^[^(]*\(/, "", args)
    sub(/\);$/, "", args)
    match(text, /[a-z0-9_]+\(/)
    name = substr(text, RSTART, RLENGTH - 1)
    n = split(args, part, /, */)
    for (k = 1; k <= n; k++) {
        sub(/\[.*/, "", part[k])
        match(part[k], /[A-Za-z0-9_]+$/)
        names = names (k > 1 ? ", " : "") substr(part[k], RSTART)
    }
    sub(/.*[^a-z]/, "", part[n])
    body = body sprintf("enum ad_status __real_%s(%s);\nenum ad_status __wrap_%s(%s);\nenum ad_status __wrap_%s(%s)\n{\n", name, args, name, args, name, args)
    body = body sprintf("    const void *place = __builtin_return_address(0);\n    const enum call call = call_begins(\"%s\", place, %s);\n", name, part[n])
    body = body sprintf("    const enum ad_status status = __real_%s(%s);\n    return call_ends(\"%s\", call, status, %s);\n}\n", name, names, name, part[n])
    used[FILENAME] = 1
}
FNR == 1 { text = ""; comment = 0 }
{ gsub(/\/\*.*\*\//, "") }
/\/\*/ { comment = 1 }
comment { if (/\*\//) comment = 0; next }
/^#|[{}]|^ *$/ { text = ""; next }
{
    sub(/^ +/, "")
    sub(/ +$/, "")
    text = text (text == "" ? "" : " ") $0
}
/;$/ { look(); text = "" }
END {
    for (file in used) print "#include \"" file "\""
    print "#include \"tests/contract/calls.h\"\n" body
}
