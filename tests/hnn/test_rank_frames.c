/* Ranks that each read their share of frames: the trajectories of their pairs and no more; training
   on them ends in the same file, to the last bit, also resumed on another number of them. */
#include "small.h"
#include "hnn/pixels/latent.h"
#include "tests/close.h"
#include "tests/files.h"
#include "tests/mentions.h"
#include "tests/ranks.h"

#include <stdlib.h>
#include <string.h>

enum { VIDEOS = 60, FRAMES = 402, SIDE = 3, AREA = SIDE * SIDE, STEPS = 6, MOST = 4 };
static const double fraction = 0.2; /* for the test: few enough that every rank has all of it */
static const uint64_t seed = 4;

struct job {
    const char *file[MOST]; /* of each rank */
    size_t batch, from, to;
    struct path out;
    struct hnn_frames frames[MOST];
    struct hnn_split_pairs pairs[MOST];
    struct hnn_video_motion motion[MOST];
    struct ad_error error[MOST];
};

static void train(struct job *j, const struct hnn_samples part[2], struct ad_ranks *ranks,
                  struct hnn_video_motion *motion, struct ad_error *error)
{
    size_t rank = ranks ? ranks->rank : 0;
    struct hnn_settings net = hnn_pixel_defaults(HNN_HAMILTONIAN, 2 * AREA);
    struct hnn_training training = hnn_pixel_training_defaults();
    hnn_model *model = NULL;
    hnn_trainer *trainer = NULL;
    net.hidden[0] = net.hidden[1] = net.autoencoder = 6;
    training.ranks = ranks;
    training.steps = STEPS;
    training.every = 3;
    training.batch = j->batch;
    if (hnn_model_new(&net, &model, error) == AD_OK &&
        hnn_trainer_new(model, &training, &part[0], &part[1], &trainer, error) == AD_OK &&
        (!j->from || hnn_trainer_resume(trainer, j->out.text, error) == AD_OK) &&
        hnn_trainer_advance(trainer, j->to - j->from, NULL, error) == AD_OK &&
        hnn_trainer_save(trainer, j->out.text, "x", error) == AD_OK)
        hnn_video_motion(model, &j->frames[rank], &j->pairs[rank], motion, error);
    hnn_trainer_free(trainer);
    hnn_model_free(model);
}

static void work(void *context, struct ad_ranks *ranks)
{
    struct job *j = context;
    size_t rank = ranks ? ranks->rank : 0;
    struct ad_error *error = &j->error[rank];
    struct hnn_frames *f = &j->frames[rank];
    struct hnn_split_pairs *pairs = &j->pairs[rank];
    if (hnn_frames_read_split(j->file[rank], fraction, seed, ranks, f, pairs, error) != AD_OK)
        return;
    struct hnn_samples part[2] = {{.n = pairs->n_train, .first = pairs->train},
                                  {.n = pairs->n_test, .first = pairs->test}};
    for (size_t k = 0; k < 2; k++) {
        part[k].frames = f->pixels;
        part[k].frame = AREA;
        hnn_samples_share(ranks, part[k].n, &part[k].begin, &part[k].end);
    }
    train(j, part, ranks, &j->motion[rank], error);
}

static void run(struct job *job, size_t count, size_t from, size_t to)
{
    job->from = from;
    job->to = to;
    with_ranks(count, work, job);
    for (size_t k = 0; k < count + !count; k++)
        if (job->error[k].status != AD_OK)
            fail_msg("rank %zu of %zu: %s", k, count, job->error[k].message);
}

static void drop(struct job *job, size_t count)
{
    for (size_t k = 0; k < count; k++) {
        hnn_frames_free(&job->frames[k]);
        hnn_split_pairs_free(&job->pairs[k]);
    }
}

/* Trajectories are as in the whole, or were not read. */
static void check_held(const struct hnn_frames *f, const struct hnn_frames *whole, size_t count)
{
    const size_t n = FRAMES * AREA;
    size_t held = 0;
    for (size_t i = 0; i < VIDEOS; i++) {
        bool read = f->pixels[i * n] != 0; /* always lit */
        held += read;
        for (size_t k = 0; k < n; k++)
            assert_true(f->pixels[i * n + k] == (read ? whole->pixels[i * n + k] : 0));
    }
    /* 48 to train on, of which 8192 pairs more on either side, 12 for the test, 4 followed */
    assert_in_range(held, count > 1 ? 12 : VIDEOS, count < 3 ? VIDEOS : 48 / count + 43 + 12 + 4);
    if (count == MOST)
        assert_true(held < VIDEOS);
}

static void write_frames(const char *file, double change)
{
    struct hnn_frames f = {.trajectories = VIDEOS, .frames = FRAMES, .height = SIDE, .width = SIDE};
    double *values = small_values(7, VIDEOS * FRAMES, AREA);
    struct ad_error error = {0};
    f.pixels = malloc(VIDEOS * FRAMES * AREA * sizeof *f.pixels);
    for (size_t k = 0; k < VIDEOS * FRAMES * AREA; k++) /* the last pixel is dark but once */
        f.pixels[k] = k % AREA == AREA - 1 ? 0 : (float)(0.5 + 0.4 * values[k]);
    f.pixels[VIDEOS * FRAMES * AREA - 1] = (float)change;
    f.pixels[(VIDEOS - 1) * FRAMES * AREA] = (float)change;
    assert_int_equal(hnn_frames_save(&f, file, &error), AD_OK);
    free(f.pixels);
    free(values);
}

static void test_shares(void **state)
{
    (void)state;
    struct path file = files_temporary("frames.h5");
    write_frames(file.text, 0.25);
    for (int drawn = 0; drawn < 2; drawn++) {
        struct job job = {.batch = drawn ? 450 : 0, .out = files_temporary("model.h5")};
        size_t whole_bytes, bytes;
        for (size_t k = 0; k < MOST; k++)
            job.file[k] = file.text;
        run(&job, 0, 0, STEPS);
        char *whole = files_read(job.out.text, &whole_bytes);
        struct hnn_frames frames = job.frames[0];
        struct hnn_video_motion motion = job.motion[0];
        assert_true(motion.mean.latent > 0 && motion.mean.latent_data > 0);
        assert_true(motion.mean.frames > 0 && motion.mean.frames_data > 0);
        hnn_split_pairs_free(&job.pairs[0]);
        for (size_t count = 2; count <= MOST; count++) {
            run(&job, MOST + 1 - count, 0, 3);
            drop(&job, MOST + 1 - count);
            run(&job, count, 3, STEPS);
            char *parts = files_read(job.out.text, &bytes);
            assert_int_equal(bytes, whole_bytes);
            assert_memory_equal(parts, whole, bytes);
            free(parts);
            for (size_t k = 0; k < count; k++) {
                check_held(&job.frames[k], &frames, count);
                assert_memory_equal(&job.motion[k].mean, &motion.mean, sizeof motion.mean);
            }
            drop(&job, count);
        }
        free(whole);
        hnn_frames_free(&frames);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_shares)};
    return cmocka_run_group_tests(tests, files_setup, files_teardown);
}
