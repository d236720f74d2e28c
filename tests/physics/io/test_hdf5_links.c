/* E5, E7: HDF5 files with external links are refused wherever they are opened; circular links and
   deep groups are harmless. */
#include "tests/close.h"
#include "tests/files.h"
#include "hnn/hnn.h"
#include "hnn/data/data.h"
#include "physics/io/hdf5_file.h"
#include "tests/mentions.h"

#include <hdf5.h>
#include <stdlib.h>
#include <string.h>

static const char secret[] = "secret.bin";

static hid_t dataset_with(hid_t file, const char *name, hid_t storage)
{
    const hsize_t four = 4;
    hid_t space = H5Screate_simple(1, &four, NULL);
    hid_t id = H5Dcreate2(file, name, H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, storage, H5P_DEFAULT);
    H5Sclose(space);
    return id;
}

static void external_link(hid_t file)
{
    assert_true(H5Lcreate_external("other.h5", "/q", file, "q", H5P_DEFAULT, H5P_DEFAULT) >= 0);
}

static void external_link_below(hid_t file)
{
    hid_t group = H5Gcreate2(file, "a", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    external_link(group);
    H5Gclose(group);
    assert_true(H5Lcreate_soft("/a/q", file, "q", H5P_DEFAULT, H5P_DEFAULT) >= 0);
}

static void external_storage(hid_t file)
{
    hid_t storage = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_external(storage, files_temporary(secret).text, 0, 32);
    H5Dclose(dataset_with(file, "q", storage));
    H5Pclose(storage);
}

static void virtual_dataset(hid_t file)
{
    const hsize_t four = 4;
    hid_t storage = H5Pcreate(H5P_DATASET_CREATE), space = H5Screate_simple(1, &four, NULL);
    H5Pset_virtual(storage, space, "other.h5", "/q", space);
    H5Dclose(dataset_with(file, "q", storage));
    H5Sclose(space);
    H5Pclose(storage);
}

static void plugin_filter(hid_t file)
{
    const hsize_t four = 4;
    hid_t storage = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_chunk(storage, 1, &four);
    H5Pset_filter(storage, 32015, H5Z_FLAG_OPTIONAL, 0, NULL);
    H5Dclose(dataset_with(file, "q", storage));
    H5Pclose(storage);
}

static void write_file(const char *name, void (*fill)(hid_t file))
{
    hid_t file = H5Fcreate(name, H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    assert_true(file >= 0);
    fill(file);
    assert_true(H5Fclose(file) >= 0);
}

static void test_leads_out(void **state)
{
    (void)state;
    static const struct {
        void (*fill)(hid_t file);
        const char *name;
    } cases[] = {{external_link, "'/q'"},
                 {external_link_below, "'a/q'"},
                 {external_storage, "'q'"},
                 {virtual_dataset, "'q'"},
                 {plugin_filter, "'q'"}};
    files_write_text(secret, "thirty-two bytes of another file");
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct path path = files_temporary("out.h5");
        struct ad_error error = {0}, of_model = {0};
        phys_hdf5 *file;
        hnn_model *model;
        write_file(path.text, cases[k].fill);
        assert_int_equal(phys_hdf5_open(path.text, &file, &error), AD_E_INPUT);
        assert_null(file);
        assert_mentions(error.message, cases[k].name);
        assert_int_equal(hnn_model_load(path.text, &model, &of_model), AD_E_INPUT);
        struct hnn_dataset data;
        struct hnn_dataset_settings settings = {
            .size = sizeof settings, .file = path.text, .state = "q,q"};
        struct ad_error of_data = {0};
        assert_int_equal(hnn_dataset_read(&settings, &data, &of_data), AD_E_INPUT);
        assert_mentions(of_data.message, cases[k].name);
    }
}

/* ---- what is allowed ---- */

struct seen {
    size_t objects, attributes, longest;
    char names[200];
};

static void see(void *context, const struct phys_hdf5_item *item)
{
    struct seen *seen = context;
    size_t length = strlen(item->object);
    seen->attributes += item->attribute != NULL;
    seen->longest = length > seen->longest ? length : seen->longest;
    if (item->attribute)
        return;
    seen->objects++;
    if (strlen(seen->names) + length + 2 < sizeof seen->names)
        strcat(strcat(seen->names, item->object), ";");
}

static struct seen seen_in(const char *name)
{
    struct ad_error error = {0};
    struct seen seen = {0};
    phys_hdf5 *file;
    if (phys_hdf5_open(name, &file, &error) != AD_OK)
        fail_msg("%s", error.message);
    assert_int_equal(phys_hdf5_list(file, see, &seen, &error), AD_OK);
    phys_hdf5_close(file);
    return seen;
}

static void built_in(hid_t file)
{
    const hsize_t four = 4;
    const double values[] = {1.5, -2.5, 3.25, 0.125};
    hid_t storage = H5Pcreate(H5P_DATASET_CREATE);
    hid_t group = H5Gcreate2(file, "b", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    H5Pset_chunk(storage, 1, &four);
    H5Pset_shuffle(storage);
    H5Pset_deflate(storage, 6);
    H5Pset_fletcher32(storage);
    hid_t q = dataset_with(group, "q", storage);
    assert_true(H5Dwrite(q, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) >= 0);
    H5Dclose(q);
    H5Pclose(storage);
    assert_true(H5Lcreate_soft("/b/q", file, "a", H5P_DEFAULT, H5P_DEFAULT) >= 0);
    assert_true(H5Lcreate_soft("/nowhere", file, "dangling", H5P_DEFAULT, H5P_DEFAULT) >= 0);
    assert_true(H5Lcreate_hard(group, "q", file, "c", H5P_DEFAULT, H5P_DEFAULT) >= 0);
    assert_true(H5Lcreate_hard(file, "/", group, "up", H5P_DEFAULT, H5P_DEFAULT) >= 0);
    H5Dclose(dataset_with(file, "z", H5P_DEFAULT)); /* after what was met before */
    H5Gclose(group);
}

static void test_links_inside(void **state)
{
    (void)state;
    struct path path = files_temporary("in.h5");
    struct ad_error error = {0};
    double values[4] = {0};
    phys_hdf5 *file;
    write_file(path.text, built_in);
    assert_string_equal(seen_in(path.text).names, ";b;b/q;z;");
    assert_int_equal(phys_hdf5_open(path.text, &file, &error), AD_OK);
    assert_int_equal(phys_hdf5_read(file, "a", 1, 3, values, &error), AD_OK);
    phys_hdf5_close(file);
    assert_true(values[0] == -2.5 && values[1] == 3.25 && values[2] == 0.125);
}

static void attributes(hid_t file)
{
    const hsize_t three = 3;
    const double values[] = {1.5, 2.5, 3.5};
    hid_t space = H5Screate_simple(1, &three, NULL), scalar = H5Screate(H5S_SCALAR);
    hid_t text = H5Tcopy(H5T_C_S1);
    H5Tset_size(text, 5);
    hid_t list = H5Acreate2(file, "list", H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT);
    hid_t one = H5Acreate2(file, "one", H5T_NATIVE_DOUBLE, scalar, H5P_DEFAULT, H5P_DEFAULT);
    hid_t fixed = H5Acreate2(file, "fixed", text, scalar, H5P_DEFAULT, H5P_DEFAULT);
    assert_true(H5Awrite(list, H5T_NATIVE_DOUBLE, values) >= 0);
    assert_true(H5Awrite(one, H5T_NATIVE_DOUBLE, values + 1) >= 0);
    assert_true(H5Awrite(fixed, text, "abcde") >= 0);
    H5Aclose(list), H5Aclose(one), H5Aclose(fixed);
    H5Tclose(text);
    H5Sclose(space), H5Sclose(scalar);
}

/* Each reading, right or wrong, gives back what it opened: nothing is open when a file is closed.
 */
static void test_nothing_stays_open(void **state)
{
    (void)state;
    struct path path = files_temporary("attributes.h5");
    struct ad_error error = {0};
    struct seen seen = {0};
    struct phys_hdf5_item item;
    phys_hdf5 *file;
    double number = 0, values[4];
    char *text;
    write_file(path.text, attributes);
    assert_int_equal(phys_hdf5_open(path.text, &file, &error), AD_OK);
    assert_int_equal(phys_hdf5_get(file, "/", "one", &number, &error), AD_OK);
    assert_true(number == 2.5);
    assert_int_equal(phys_hdf5_get_text(file, "/", "fixed", &text, &error), AD_OK);
    assert_string_equal(text, "abcde");
    free(text);
    static const char *const wrong[] = {"list", "fixed", "none"};
    for (size_t k = 0; k < 3; k++) {
        struct ad_error refused = {0};
        assert_int_equal(phys_hdf5_get(file, "/", wrong[k], &number, &refused), AD_E_INPUT);
        assert_mentions(refused.message, wrong[k]);
    }
    static const char *const no_text[] = {"list", "one", "none"};
    for (size_t k = 0; k < 3; k++) {
        struct ad_error refused = {0};
        assert_int_equal(phys_hdf5_get_text(file, "/", no_text[k], &text, &refused), AD_E_INPUT);
        assert_null(text);
    }
    struct ad_error missing = {0};
    assert_int_equal(phys_hdf5_shape(file, "q", &item, &missing), AD_E_INPUT);
    missing = (struct ad_error){0};
    assert_int_equal(phys_hdf5_read(file, "q", 0, 1, values, &missing), AD_E_INPUT);
    assert_int_equal(phys_hdf5_list(file, see, &seen, &error), AD_OK);
    assert_int_equal(seen.attributes, 3);
    assert_int_equal(H5Fget_obj_count(H5F_OBJ_ALL, H5F_OBJ_ALL), 1);
    phys_hdf5_close(file);
    assert_int_equal(H5Fget_obj_count(H5F_OBJ_ALL, H5F_OBJ_ALL), 0);
    write_file(path.text, built_in);
    assert_int_equal(seen_in(path.text).objects, 4);
    write_file(path.text, external_link_below);
    assert_int_equal(phys_hdf5_open(path.text, &file, &error), AD_E_INPUT);
    assert_int_equal(H5Fget_obj_count(H5F_OBJ_ALL, H5F_OBJ_ALL), 0);
}

enum { DEPTH = 3000 };

static void deep(hid_t file)
{
    hid_t at = file;
    for (int k = 0; k < DEPTH; k++) {
        hid_t below = H5Gcreate2(at, "g", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
        assert_true(below >= 0);
        if (at != file)
            H5Gclose(at);
        at = below;
    }
    H5Gclose(at);
}

static void test_deep(void **state)
{
    (void)state;
    struct path path = files_temporary("deep.h5");
    write_file(path.text, deep);
    struct seen seen = seen_in(path.text);
    assert_int_equal(seen.objects, DEPTH + 1);
    assert_int_equal(seen.longest, 2 * DEPTH - 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_leads_out),
        cmocka_unit_test(test_links_inside),
        cmocka_unit_test(test_deep),
        cmocka_unit_test(test_nothing_stays_open),
    };
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    return cmocka_run_group_tests(tests, files_setup, files_teardown);
}
