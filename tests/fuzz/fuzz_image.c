/* Fuzzer of pictures: no input crashes the reader; accepted ones have all their pixels, and
   refusals have a message. */
#include "fuzz.h"

#include "hnn/pixels/frames.h"

int fuzz_image(const uint8_t *data, size_t size)
{
    struct hnn_image image;
    struct ad_error error = {0};
    if (hnn_image_read(fuzz_file(data, size), &image, &error) == AD_OK) {
        size_t n = image.height * image.width, sum = 0;
        for (size_t k = 0; k < n; k++) /* reads all of them */
            sum += image.pixels[k];
        fuzz_require(n > 0 && sum <= 255 * n);
    } else {
        fuzz_require(error.message[0] && error.status == AD_E_INPUT && !image.pixels);
    }
    free(image.pixels);
    return 0;
}
