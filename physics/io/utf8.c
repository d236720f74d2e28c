/* Printable characters of UTF-8 text (utf8.h). */
#include "utf8.h"

size_t phys_utf8_length(const char *text)
{
    static const struct {
        unsigned char first, last, second_least, second_most;
        size_t length;
    } forms[] = {
        {0x00, 0x7f, 0, 0, 1},       {0xc2, 0xdf, 0x80, 0xbf, 2}, {0xe0, 0xe0, 0xa0, 0xbf, 3},
        {0xe1, 0xec, 0x80, 0xbf, 3}, {0xed, 0xed, 0x80, 0x9f, 3}, {0xee, 0xef, 0x80, 0xbf, 3},
        {0xf0, 0xf0, 0x90, 0xbf, 4}, {0xf1, 0xf3, 0x80, 0xbf, 4}, {0xf4, 0xf4, 0x80, 0x8f, 4}};
    const unsigned char *s = (const unsigned char *)text;
    size_t form = 0, n = sizeof forms / sizeof *forms;
    while (form < n && !(s[0] >= forms[form].first && s[0] <= forms[form].last))
        form++;
    if (form == n)
        return 0;
    size_t length = forms[form].length;
    if (length > 1 && !(s[1] >= forms[form].second_least && s[1] <= forms[form].second_most))
        return 0;
    for (size_t k = 2; k < length; k++)
        if ((s[k] & 0xc0) != 0x80)
            return 0;
    return length;
}

/* C0, DEL and C1 control characters, which a terminal may interpret. */
static bool is_control(const unsigned char *s)
{
    return s[0] < 0x20 || s[0] == 0x7f || (s[0] == 0xc2 && s[1] < 0xa0);
}

size_t phys_utf8_printable(const char *text)
{
    const unsigned char *s = (const unsigned char *)text;
    size_t length = phys_utf8_length(text);
    bool no_character = length == 3 && s[0] == 0xef && s[1] == 0xbf && s[2] >= 0xbe;
    return is_control(s) || no_character ? 0 : length;
}

bool phys_utf8_is_printable(const char *text)
{
    while (*text) {
        size_t length = phys_utf8_printable(text);
        if (length == 0)
            return false;
        text += length;
    }
    return true;
}
