# The names in what `leastaction dump` prints: /path, and /path@unit of an attribute, @seed of the root.
/^\// { object = $1 == "/" ? "" : $1; if (object != "") print object; next }
/^    [^ ]+ = / { print object "@" $1 }
