/* Models as safetensors: files of PyTorch's give its values; models come back to the bit; files
   that the format forbids are refused. */
#include "tests/close.h"
#include "tests/files.h"
#include "tests/mentions.h"
#include "hnn/model/exchange.h"
#include "hnn/model/safetensors.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static hnn_model *import_as(const char *file, const struct hnn_settings *assumed,
                            struct hnn_exchange *exchange)
{
    struct ad_error error = {0};
    hnn_model *model;
    if (hnn_model_import(file, assumed, &model, exchange, &error) != AD_OK)
        fail_msg("%s", error.message);
    return model;
}

/* torch.nn.Sequential(Linear(4, 5), Tanh, Linear(5, 3), Tanh, Linear(3, 1)), saved by the
   safetensors package; H and its gradient at x by PyTorch. */
static void values_are_those_of_pytorch(void **state)
{
    static const double x[] = {.3, -.7, 1.1, .2},
                        rate[] = {-0.031058659594832887, 0.00024067333653617594,
                                  -0.061806577616346697, -0.03549691644880875};
    const struct hnn_settings assumed = hnn_defaults(HNN_HAMILTONIAN, 1);
    struct hnn_exchange exchange;
    double field[4];
    (void)state;
    hnn_model *model = import_as(files_data("exchange/mlp.safetensors").text, &assumed, &exchange);
    assert_false(exchange.own);
    assert_int_equal(hnn_model_settings(model)->precision, AD_F64);
    assert_close(exchange.bias, 0.16852058000844627, 0, 0);
    assert_close(hnn_model_energy(model, x) + exchange.bias, 0.07739162307180353, 0, 1e-15);
    assert_int_equal(hnn_model_field(model, x, field), AD_OK);
    for (int k = 0; k < 4; k++)
        assert_close(field[k], rate[k], 1e-13, 0);
    hnn_model_free(model);
}

/* The same network in fewer bits: each weight is the nearest there is. */
static void short_types_are_exact(void **state)
{
    static const struct {
        const char *file;
        int bits;
    } rows[] = {{"exchange/mlp32.safetensors", 24},
                {"exchange/mlp16.safetensors", 11},
                {"exchange/mlpb16.safetensors", 8}};
    const struct hnn_settings assumed = hnn_defaults(HNN_HAMILTONIAN, 1);
    struct hnn_exchange exchange;
    (void)state;
    hnn_model *full = import_as(files_data("exchange/mlp.safetensors").text, &assumed, &exchange);
    const double *wanted = hnn_model_parameters(full);
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        hnn_model *model = import_as(files_data(rows[r].file).text, &assumed, &exchange);
        const float *got = hnn_model_parameters(model);
        assert_int_equal(hnn_model_size(model), hnn_model_size(full));
        for (size_t k = 0; k < hnn_model_size(model); k++) {
            int exponent;
            const double unit = (frexp(wanted[k], &exponent), ldexp(1, exponent - rows[r].bits));
            const double nearest = unit * nearbyint(wanted[k] / unit);
            assert_close((double)got[k], nearest, 0, 0);
        }
        hnn_model_free(model);
    }
    hnn_model_free(full);
}

static const struct path *write_tensors(const char *header, const void *data, size_t bytes)
{
    static struct path path;
    const size_t n = strlen(header);
    unsigned char *all = malloc(8 + n + bytes);
    assert_non_null(all);
    for (int k = 0; k < 8; k++)
        all[k] = (unsigned char)((uint64_t)n >> 8 * k & 255);
    memcpy(all + 8, header, n);
    if (bytes)
        memcpy(all + 8 + n, data, bytes);
    path = files_write("a.safetensors", (char *)all, 8 + n + bytes);
    free(all);
    return &path;
}

static void bits_are_numbers(void **state)
{
    static const unsigned char data[] = {1, 0x3c, 1, 0,    0, 0x80, 0xff, 0x7b,
                                         1, 0x84, 0, 0x3c, 1, 0x00, 0x81, 0x3f};
    static const double half[] = {1.0009765625, 0x1p-24, -0., 65504, -0x1.004p-14, 1},
                        brain[] = {0x1p-133, 1.0078125};
    struct hnn_tensors t;
    struct ad_error error = {0};
    double values[6];
    (void)state;
    const struct path *path =
        write_tensors(" {\"h\\u00e9\\ud83d\\ude00\":{\"shape\":[2,3],\"dtype\":\"F16\","
                      "\"data_offsets\":[0,12]},\n \"b\" : {\"dtype\":\"BF16\",\"shape\":[2], "
                      "\"data_offsets\":[12,16]}} ",
                      data, sizeof data);
    if (hnn_tensors_read(path->text, &t, &error) != AD_OK)
        fail_msg("%s", error.message);
    const struct hnn_tensor *h = hnn_tensor_find(&t, "h\xc3\xa9\xf0\x9f\x98\x80"),
                            *b = hnn_tensor_find(&t, "b");
    assert_non_null(h);
    assert_int_equal(hnn_tensor_values(&t, h, 0, 6, values, &error), AD_OK);
    assert_memory_equal(values, half, sizeof half);
    assert_int_equal(hnn_tensor_values(&t, b, 0, 2, values, &error), AD_OK);
    assert_memory_equal(values, brain, sizeof brain);
    hnn_tensors_free(&t);
}

#define W(n) "\"dtype\":\"F32\",\"shape\":[1," #n "]"

static void forbidden_files_are_refused(void **state)
{
    static const char data[64];
    static const struct {
        const char *header, *why;
        size_t bytes;
    } rows[] = {
        {"", "not a safetensors file", 0},
        {"[]", "expected '{'", 0},
        {"{ ", "expected '\"'", 0},
        {"{}x", "text behind the object", 0},
        {"{}", "has 8 bytes of data, expected 0", 8},
        {"{\"a\":{" W(2) ",\"data_offsets\":[0,8]}}", "has 4 bytes of data, expected 8", 4},
        {"{\"a\":{" W(2) ",\"data_offsets\":[0,8]}}", "has 12 bytes of data, expected 8", 12},
        {"{\"a\":{" W(2) ",\"data_offsets\":[0,4]}}", "do not agree", 4},
        {"{\"a\":{" W(2) ",\"data_offsets\":[8,0]}}", "do not agree", 8},
        {"{\"a\":{" W(2) ",\"data_offsets\":[4,12]}}", "'a' begins at byte 4", 12},
        {"{\"a\":{" W(2) ",\"data_offsets\":[0,8]},\"b\":{" W(1) ",\"data_offsets\":[4,8]}}",
         "'b' begins at byte 4 of the data; expected 8", 8},
        {"{\"a\":{" W(1) ",\"data_offsets\":[0,4]},\"b\":{" W(1) ",\"data_offsets\":[8,12]}}",
         "'b' begins at byte 8 of the data; expected 4", 12},
        {"{\"a\":{" W(1) ",\"data_offsets\":[0,4]},\"a\":{" W(1) ",\"data_offsets\":[4,8]}}",
         "a name twice", 8},
        {"{\"a\":{" W(1) ",\"data_offsets\":[0,4],\"dtype\":\"F32\"}}", "once each", 4},
        {"{\"a\":{\"dtype\":\"F32\",\"data_offsets\":[0,4]}}", "expected dtype, shape", 4},
        {"{\"a\":{" W(1) ",\"data_offsets\":[0]}}", "two data_offsets", 4},
        {"{\"a\":{" W(1) ",\"data_offsets\":[0,4,4]}}", "more numbers than expected", 4},
        {"{\"a\":{\"dtype\":\"F8\",\"shape\":[1],\"data_offsets\":[0,1]}}", "unknown dtype", 1},
        {"{\"a\":{\"dtype\":\"F32\",\"shape\":[1,1,1,1,1],\"data_offsets\":[0,4]}}",
         "more numbers than expected", 4},
        {"{\"a\":{\"dtype\":\"F32\",\"shape\":[4294967296,4294967296],\"data_offsets\":[0,0]}}",
         "nothing holds", 0},
        {"{\"a\":{\"dtype\":\"F32\",\"shape\":[18446744073709551616],\"data_offsets\":[0,0]}}",
         "over 2^64", 0},
        {"{\"a\":{\"dtype\":\"F32\",\"shape\":[-1],\"data_offsets\":[0,4]}}", "a whole number", 4},
        {"{\"a\":{\"dtype\":\"F32\",\"shape\":[01],\"data_offsets\":[0,4]}}", "a whole number", 4},
        {"{\"a\":{\"dtype\":\"F32\",\"shape\":[1.0],\"data_offsets\":[0,4]}}", "expected ']'", 4},
        {"{\"a\":{" W(1) ",\"data_offsets\":[0,4]},}", "expected '\"'", 4},
        {"{\"__metadata__\":{\"a\":1}}", "expected '\"'", 0},
        {"{\"__metadata__\":{\"a\":\"1\",\"a\":\"2\"}}", "a key of __metadata__ twice", 0},
        {"{\"__metadata__\":{\"a\":\"1\"},\"__metadata__\":{}}", "__metadata__ twice", 0},
        {"{\"\\x\":1}", "unknown escape", 0},
        {"{\"\\u12g4\":1}", "hexadecimal", 0},
        {"{\"\\ud800\":1}", "surrogate", 0},
        {"{\"\\ud800\\u0041\":1}", "a character that is none", 0},
        {"{\"\\u0000\":1}", "a character that is none", 0},
        {"{\"\n\":1}", "control character", 0},
        {"{\"\xff\":1}", "not UTF-8", 0},
        {"{\"a", "expected '\"'", 0},
        {"{\"a\\", "unknown escape", 0},
    };
    (void)state;
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        struct hnn_tensors t;
        struct ad_error error = {0};
        const struct path *path = write_tensors(rows[k].header, data, rows[k].bytes);
        assert_int_equal(hnn_tensors_read(path->text, &t, &error), AD_E_INPUT);
        assert_mentions(error.message, rows[k].why);
        hnn_tensors_free(&t);
    }
    static const char *const cut[] = {"", "1234567", "\xff\xff\xff\xff\xff\xff\xff\xff{}",
                                      "\x03\0\0\0\0\0\0\0{}"};
    static const size_t length[] = {0, 7, 10, 10};
    for (size_t k = 0; k < 4; k++) {
        struct hnn_tensors t;
        struct ad_error error = {0};
        const struct path path = files_write("cut.safetensors", cut[k], length[k]);
        assert_int_equal(hnn_tensors_read(path.text, &t, &error), AD_E_INPUT);
        assert_mentions(error.message, "not a safetensors file");
        hnn_tensors_free(&t);
    }
}

#define T(name, shape, at, end)                                                                    \
    "\"" name "\":{\"dtype\":\"F32\",\"shape\":" shape ",\"data_offsets\":[" #at "," #end "]}"

/* Of what the format allows, what is no perceptron of ours. */
static void other_networks_are_refused(void **state)
{
    static const float data[16] = {[2] = 0.5f, [15] = INFINITY};
    static const struct {
        const char *header, *why;
        size_t bytes;
        enum hnn_kind kind;
    } rows[] = {
        {"{}", "has no X.weight", 0, HNN_HAMILTONIAN},
        {"{" T("a.weight", "[1,2]", 0, 8) "," T("b", "[1]", 8, 12) "}", "'b' is neither", 12,
         HNN_HAMILTONIAN},
        {"{" T("1.weight", "[3,2]", 0, 24) "," T("2.weight", "[1,2]", 24, 32) "}",
         "'2.weight' has 2 columns, expected 3, the rows of '1.weight'", 32, HNN_HAMILTONIAN},
        {"{" T("1.weight", "[1,3]", 0, 12) "}", "an even number", 12, HNN_HAMILTONIAN},
        {"{" T("1.weight", "[3,2]", 0, 24) "}", "has 3 rows; expected 1 of model hnn", 24,
         HNN_HAMILTONIAN},
        {"{" T("1.weight", "[1,2]", 0, 8) "," T("1.bias", "[2]", 8, 16) "}", "another shape", 16,
         HNN_HAMILTONIAN},
        {"{" T("1.weight", "[2,2]", 0, 16) "," T("1.bias", "[2]", 16, 24) "}", "", 24,
         HNN_BASELINE},
        {"{" T("bias", "[2]", 0, 8) "," T("weight", "[2,2]", 8, 24) "}", "", 24, HNN_BASELINE},
        {"{" T("1.weight", "[2,2]", 0, 16) "," T("1.bias", "[2,1]", 16, 24) "}", "another shape",
         24, HNN_BASELINE},
        {"{" T("1.weight", "[8,2]", 0, 64) "," T("2.weight", "[1,8]", 64, 96) "}",
         "element 16 is not finite", 96, HNN_HAMILTONIAN},
        {"{\"1.weight\":{\"dtype\":\"I32\",\"shape\":[1,2],\"data_offsets\":[0,8]}}",
         "is of whole numbers", 8, HNN_HAMILTONIAN},
        {"{\"__metadata__\":{\"format\":\"leastaction model\"}}", "version is ''", 0,
         HNN_HAMILTONIAN},
    };
    char room[128] = {0};
    (void)state;
    memcpy(room, data, sizeof data);
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        const struct hnn_settings assumed = hnn_defaults(rows[k].kind, 1);
        struct ad_error error = {0};
        struct hnn_exchange exchange;
        hnn_model *model;
        const struct path *path = write_tensors(rows[k].header, room, rows[k].bytes);
        hnn_model_import(path->text, &assumed, &model, &exchange, &error);
        assert_int_equal(error.status, *rows[k].why ? AD_E_INPUT : AD_OK);
        if (*rows[k].why)
            assert_mentions(error.message, rows[k].why);
        hnn_model_free(model);
    }
    const struct hnn_settings baseline = hnn_defaults(HNN_BASELINE, 1);
    struct ad_error error = {0};
    struct hnn_exchange exchange;
    hnn_model *model;
    const struct path *path =
        write_tensors("{" T("1.bias", "[2]", 8, 16) "," T("1.weight", "[2,1]", 0, 8) "}", room, 16);
    assert_int_equal(hnn_model_import(path->text, &baseline, &model, &exchange, &error),
                     AD_E_INPUT);
    path = write_tensors("{" T("1.weight", "[2,2]", 8, 24) "," T("1.bias", "[2]", 0, 8) "}",
                         (const char *)room + 4, 24);
    error = (struct ad_error){0};
    assert_int_equal(hnn_model_import(path->text, &baseline, &model, &exchange, &error),
                     AD_E_INPUT);
    assert_mentions(error.message, "'1.bias' is 0.5: the last map of a baseline has no bias");
}

/* Of F and H, the published two outputs, the field chooses. */
static void outputs_are_chosen(void **state)
{
    static const float data[] = {1, 2, 3, 4}; /* F = q + 2 p, H = 3 q + 4 p */
    static const double rate[][2] = {{4, -3}, {1, 2}, {5, -1}};
    struct hnn_settings assumed = hnn_defaults(HNN_HAMILTONIAN, 1);
    (void)state;
    const struct path *path =
        write_tensors("{" T("linear1.weight", "[2,2]", 0, 16) "}", data, sizeof data);
    for (int k = 0; k < 3; k++) {
        struct hnn_exchange exchange;
        double field[2];
        assumed.field = (enum hnn_field_type)k;
        hnn_model *model = import_as(path->text, &assumed, &exchange);
        assert_int_equal(hnn_model_field(model, (double[]){.2, .4}, field), AD_OK);
        assert_true(field[0] == rate[k][0] && field[1] == rate[k][1]);
        hnn_model_free(model);
    }
}

/* Maps stand in the order of the numbers in their names, not of the file. */
static void maps_are_ordered_by_number(void **state)
{
    static const float data[] = {5, 0, 1, 1, 2}; /* 9: q + 2 p; 10: times 5 */
    const struct hnn_settings assumed = hnn_defaults(HNN_LAGRANGIAN, 1);
    struct hnn_settings sine = assumed;
    struct hnn_exchange exchange;
    (void)state;
    sine.activation = "relu";
    sine.kind = HNN_HAMILTONIAN;
    hnn_model *model = import_as(
        write_tensors("{" T("net.10.weight", "[1,1]", 0, 4) "," T("net.9.bias", "[1]", 4, 8) "," T(
                          "net.9.weight", "[1,2]", 12, 20) "," T("net.10.bias", "[1]", 8, 12) "}",
                      data, sizeof data)
            ->text,
        &sine, &exchange);
    assert_true(exchange.bias == 1);
    assert_close(hnn_model_energy(model, (double[]){1, 3}), 35, 1e-14, 0);
    hnn_model_free(model);
}

/* Names without numbers say no order: that of the shapes is taken where there is one. */
static void maps_without_an_order_are_refused(void **state)
{
    static const float data[10] = {1, 2, 5, 3, 1, 1, 1, 1, 1, 1};
    const struct hnn_settings assumed = hnn_defaults(HNN_LAGRANGIAN, 1);
    static const char *const refused[] = {
        "{" T("input.weight", "[2,2]", 0, 16) "," T("hidden.weight", "[2,2]", 16,
                                                    32) "," T("output.weight", "[1,2]", 32, 40) "}",
        "{" T("two.0.weight", "[2,2]", 0, 16) "," T("one.0.weight", "[2,2]", 16,
                                                    32) "," T("z.0.weight", "[1,2]", 32, 40) "}",
        "{" T("a.weight", "[3,2]", 0, 24) "," T("b.weight", "[1,4]", 24, 40) "}"};
    struct hnn_exchange exchange;
    hnn_model *model;
    (void)state;
    for (size_t k = 0; k < sizeof refused / sizeof *refused; k++) {
        struct ad_error error = {0};
        const struct path *path = write_tensors(refused[k], data, sizeof data);
        assert_int_equal(hnn_model_import(path->text, &assumed, &model, &exchange, &error),
                         AD_E_INPUT);
        assert_mentions(error.message, k < 2 ? "nor shapes tell their order" : "fit in no order");
    }
    /* a: 1 x 1 behind in: 1 x 2, and hidden2 behind hidden1 whatever the rest */
    model = import_as(
        write_tensors("{" T("a.weight", "[1,1]", 8, 12) "," T("in.weight", "[1,2]", 0, 8) "}", data,
                      12)
            ->text,
        &assumed, &exchange);
    assert_close(hnn_model_energy(model, (double[]){0, 0}), 0, 1e-14, 1e-14);
    assert_int_equal(hnn_model_settings(model)->layers, 2);
    assert_true(((const float *)hnn_model_parameters(model))[0] == 1);
    hnn_model_free(model);
    model = import_as(
        write_tensors("{" T("fc1.weight", "[2,2]", 0, 16) "," T(
                          "fc2.weight", "[2,2]", 16, 32) "," T("end.weight", "[1,2]", 32, 40) "}",
                      data, sizeof data)
            ->text,
        &assumed, &exchange);
    assert_true(((const float *)hnn_model_parameters(model))[2] == 5);
    hnn_model_free(model);
}

static void models_come_back_to_the_bit(void **state)
{
    static const double scale[] = {.5, 2, 1, 3}, centre[] = {.1, -.2, .3, 1. / 3};
    struct hnn_settings s[4];
    (void)state;
    for (int k = 0; k < 4; k++) {
        s[k] = hnn_defaults(k == 1 ? HNN_LAGRANGIAN : k == 3 ? HNN_BASELINE : HNN_HAMILTONIAN, 2);
        s[k].hidden[0] = 5;
        s[k].hidden[1] = 3 + (size_t)k;
        s[k].precision = k % 2 ? AD_F64 : AD_F32;
        s[k].seed = UINT64_MAX - (uint64_t)k;
    }
    s[0].separable = s[0].dissipation = true;
    s[0].activation = "gelu";
    s[1].quadratic = true;
    s[1].angles = 2;
    s[1].start = HNN_HE;
    s[2].field = HNN_BOTH;
    for (int k = 0; k < 4; k++) {
        struct ad_error error = {0};
        struct hnn_exchange exchange;
        hnn_model *model, *back;
        assert_int_equal(hnn_model_new(&s[k], &model, &error), AD_OK);
        hnn_model_note(model, "state", "a,b,\"c\\\n\t\x01\xc3\xa9,d", &error);
        hnn_model_normalise(model, centre, scale, scale, &error);
        hnn_model_see(model, 2, (double[]){1, 2, 3, 4, 5, 6, 7, 8.5}, &error);
        const struct path a = files_temporary("one.safetensors"),
                          b = files_temporary("two.safetensors");
        assert_int_equal(hnn_model_export(model, a.text, &error), AD_OK);
        back = import_as(a.text, &s[3 - k], &exchange);
        assert_true(exchange.own);
        assert_int_equal(hnn_model_export(back, b.text, &error), AD_OK);
        files_are_same(a.text, b.text);
        assert_int_equal(hnn_model_size(model), hnn_model_size(back));
        assert_memory_equal(hnn_model_parameters(model), hnn_model_parameters(back),
                            hnn_model_size(model) * (s[k].precision == AD_F32 ? 4 : 8));
        const double x[] = {.4, .3, -.2, .1};
        double rate[4], again[4];
        hnn_model_field(model, x, rate);
        hnn_model_field(back, x, again);
        assert_memory_equal(rate, again, sizeof rate);
        assert_string_equal(hnn_model_noted(back, "state"), hnn_model_noted(model, "state"));
        assert_memory_equal(hnn_model_range(back).low, hnn_model_range(model).low,
                            5 * sizeof(double));
        hnn_model_free(model);
        hnn_model_free(back);
    }
}

static void models_of_pixels_come_back(void **state)
{
    struct ad_error error = {0};
    struct hnn_exchange exchange;
    struct hnn_settings s = hnn_defaults(HNN_HAMILTONIAN, 1);
    const struct path file = files_temporary("pixels.safetensors");
    hnn_model *model, *back;
    (void)state;
    s.hidden[0] = s.hidden[1] = 3;
    s.pixels = 4;
    s.autoencoder = 5;
    assert_int_equal(hnn_model_new(&s, &model, &error), AD_OK);
    assert_int_equal(hnn_model_export(model, file.text, &error), AD_OK);
    back = import_as(file.text, &s, &exchange);
    assert_int_equal(hnn_model_settings(back)->pixels, 4);
    assert_int_equal(hnn_model_settings(back)->autoencoder, 5);
    assert_int_equal(hnn_model_size(model), hnn_model_size(back));
    assert_memory_equal(hnn_model_parameters(model), hnn_model_parameters(back),
                        hnn_model_size(model) * (s.precision == AD_F32 ? 4 : 8));
    hnn_model_free(model);
    hnn_model_free(back);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values_are_those_of_pytorch),
        cmocka_unit_test(short_types_are_exact),
        cmocka_unit_test(bits_are_numbers),
        cmocka_unit_test(forbidden_files_are_refused),
        cmocka_unit_test(other_networks_are_refused),
        cmocka_unit_test(outputs_are_chosen),
        cmocka_unit_test(maps_are_ordered_by_number),
        cmocka_unit_test(maps_without_an_order_are_refused),
        cmocka_unit_test(models_come_back_to_the_bit),
        cmocka_unit_test(models_of_pixels_come_back),
    };
    return cmocka_run_group_tests(tests, files_setup, files_teardown);
}
