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

uint32_t phys_utf8_code(const char *text)
{
    const unsigned char *s = (const unsigned char *)text;
    const size_t length = phys_utf8_length(text);
    uint32_t code = length == 1 ? s[0] : s[0] & (0x7fu >> length);
    for (size_t k = 1; k < length; k++)
        code = code << 6 | (s[k] & 0x3f);
    return code;
}

size_t phys_utf8_printable(const char *text)
{
    static const struct {
        uint32_t first, last;
    } hidden[] = {{0x00, 0x1f},     {0x7f, 0x9f},     {0xad, 0xad},       {0x61c, 0x61c},
                  {0x115f, 0x1160}, {0x180e, 0x180e}, {0x200b, 0x200f},   {0x2028, 0x202e},
                  {0x2060, 0x206f}, {0x3164, 0x3164}, {0xfeff, 0xfeff},   {0xffa0, 0xffa0},
                  {0xfff9, 0xfffb}, {0xfffe, 0xffff}, {0x1d173, 0x1d17a}, {0xe0000, 0xe0fff}};
    const size_t length = phys_utf8_length(text);
    const uint32_t code = phys_utf8_code(text);
    for (size_t k = 0; k < sizeof hidden / sizeof *hidden; k++)
        if (code >= hidden[k].first && code <= hidden[k].last)
            return 0;
    return length;
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
