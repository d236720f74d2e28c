# The keys of JSON objects, one to a line of input, as paths: tried[].rule
function value(text) { if (text ~ /^"/) text = substr(text, 2, length(text) - 2); return text }

!/^\{/ { next }
{
    rest = $0; depth = 0; name = ""
    while (match(rest, /"([^"\\]|\\.)*"|[][{}:,]|[^][{}:," ]+/)) {
        token = substr(rest, RSTART, RLENGTH); rest = substr(rest, RSTART + RLENGTH)
        if (token == "{") { inside[++depth] = (name == "" ? "" : name "."); key[depth] = 1 }
        else if (token == "[") { name = inside[++depth] = name "[]"; key[depth] = 0; list[depth] = 1 }
        else if (token == "}" || token == "]") { list[depth] = 0; depth-- }
        else if (token == ",") { if (list[depth]) name = inside[depth]; else key[depth] = 1 }
        else if (token ~ /^"/ && key[depth]) { name = inside[depth] value(token); print name; key[depth] = 0 }
    }
}
