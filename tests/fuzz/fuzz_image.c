/* Fuzzer of pictures: no input crashes the reader; what it accepts has all its pixels, what it
   refuses it explains. */
#include "fuzz.h"

#include "hnn/frames.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct hnn_image image;
    struct ad_error error = {0};
    if (hnn_image_read(fuzz_file(data, size), &image, &error) == AD_OK) {
        unsigned char most = 0;
        for (size_t k = 0; k < image.height * image.width; k++)
            most = image.pixels[k] > most ? image.pixels[k] : most;
        fuzz_require(image.height > 0 && image.width > 0 && most <= 255);
    } else {
        fuzz_require(error.message[0] && error.status == AD_E_INPUT && !image.pixels);
    }
    free(image.pixels);
    return 0;
}
