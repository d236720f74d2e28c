/* leastaction convert from outside: HDF5, safetensors, the safetensors package. */
#include "tests/apps/shell.h"
#include "tests/close.h"
#include "tests/mentions.h"

#include <string.h>

static int setup(void **state)
{
    shell_empty(state);
    shell_works("$LA dataset pendulum --trials 3 --quiet --out p.csv && "
                "$LA train p.csv --hidden 4 --steps 2 --normalise --quiet --out m.h5");
    return 0;
}

static void models_go_there_and_back(void **state)
{
    (void)state;
    shell_works("$LA convert m.h5 --out m.safetensors --json");
    assert_true(shell_number("parameters") == 36);
    shell_works("$LA convert m.safetensors --out back.h5 --quiet && "
                "$LA convert back.h5 --out back.safetensors --quiet && "
                "cmp m.safetensors back.safetensors");
    shell_works(
        "for m in m back; do $LA rollout $m.h5 --x0 1,0 --time 2 --csv $m.csv --quiet; done "
        "&& cmp m.csv back.csv");
}

/* As a program without our checksum leaves it. */
static void files_without_checksum_are_told(void **state)
{
    (void)state;
    shell_works("cp m.h5 bare.h5 && dd if=/dev/zero of=bare.h5 bs=512 count=1 conv=notrunc "
                "2>/dev/null && $LA convert bare.h5 --out whole.h5");
    assert_mentions(shell_out(), "warning bare.h5 checksum");
    shell_works("$LA convert whole.h5 --out a.safetensors");
    assert_null(strstr(shell_out(), "warning"));
    shell_works("$LA convert m.h5 --out b.safetensors --quiet && cmp a.safetensors b.safetensors");
}

static void misuse_is_refused(void **state)
{
    static const char *const wrong[][2] = {
        {"m.h5", "--out: expected a name ending in .h5 or .safetensors"},
        {"m.h5 --out m.onnx", "--out: expected a name ending in .h5 or .safetensors"},
        {"m.h5 --out m.h5", "--out m.h5"},
        {"m.h5 --out a.safetensors --model lnn", "--model is in the file; leave it out"},
        {"p.csv --out a.h5", "not a safetensors file"},
        {"none --out a.h5", "none: cannot be read"},
        {"$ROOT/tests/data/exchange/mlp.safetensors --out a.h5 --model pixel", "--model: expected"},
        {"$ROOT/tests/data/exchange/mlp.safetensors --out a.h5 --activation than", "tanh"},
        {"$ROOT/tests/data/exchange/mlp.safetensors --out a.h5 --model baseline",
         "has 1 rows; expected 4 of model baseline"},
    };
    (void)state;
    for (size_t k = 0; k < sizeof wrong / sizeof *wrong; k++) {
        assert_int_equal(shell("$LA convert %s", wrong[k][0]), 2);
        assert_mentions(shell_err(), wrong[k][1]);
    }
    shell_works("! ls a.* 2>/dev/null");
}

static void the_package_agrees(void **state)
{
    (void)state;
    const char *python = "${PYTHON:-python3}";
    if (shell("%s -c 'import safetensors.numpy'", python) != 0) {
        print_message("skipped: python3 has no safetensors\n");
        skip();
    }
    shell_works("$LA convert m.h5 --out m.safetensors --quiet && %s -c '\n"
                "import numpy, safetensors, safetensors.numpy as st\n"
                "a = st.load_file(\"m.safetensors\")\n"
                "print(a[\"linear1.weight\"].shape, a[\"normalisation\"].dtype)\n"
                "meta = safetensors.safe_open(\"m.safetensors\", \"np\").metadata()\n"
                "assert meta[\"model\"] == \"hnn\" and meta[\"hidden\"] == \"4,4\"\n"
                "st.save_file(a, \"again.safetensors\", metadata=meta)\n"
                "w = {k: v for k, v in a.items() if k.startswith(\"linear\")}\n"
                "st.save_file(w, \"bare.safetensors\")'",
                python);
    assert_string_equal(shell_out(), "(4, 2) float64\n");
    shell_works("$LA convert again.safetensors --out again.h5 --quiet && "
                "$LA convert again.h5 --out back.safetensors --quiet && "
                "cmp m.safetensors back.safetensors && "
                "$LA convert bare.safetensors --out bare.h5 --json");
    assert_true(shell_number("parameters") == 36);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(models_go_there_and_back, setup),
        cmocka_unit_test_setup(files_without_checksum_are_told, setup),
        cmocka_unit_test_setup(misuse_is_refused, setup),
        cmocka_unit_test_setup(the_package_agrees, setup),
    };
    return cmocka_run_group_tests(tests, shell_setup, shell_teardown);
}
