/* `leastaction rollout` of models of pixels (film.h): the order of things. */
#include "pixel_rollout.h"

static enum ad_status write_results(struct film *film, struct outputs *outputs,
                                    struct ad_error *error)
{
    if (outputs->file)
        film_file(film, outputs->file);
    if (outputs->csv.out)
        film_write_csv(film, outputs->csv.out);
    if (outputs->plot.script)
        film_picture(film, &outputs->plot, error);
    if (error->status == AD_OK)
        outputs_commit(outputs, error);
    else
        outputs_abandon(outputs);
    return error->status;
}

static enum ad_status follow(struct film *film, struct ad_error *error)
{
    const struct common *common = &film->options->common;
    struct outputs outputs;
    if (outputs_begin(common, &outputs, error) != AD_OK)
        return error->status;
    if (film_run(film, error) != AD_OK)
        outputs_abandon(&outputs);
    else if (write_results(film, &outputs, error) == AD_OK && common->json)
        film_print_json(film);
    else if (error->status == AD_OK && !common->quiet)
        film_print(film);
    return error->status;
}

enum ad_status film_rollout(const struct rollout_options *options, struct ad_error *error)
{
    struct film film;
    if (film_setup(options, &film, error) == AD_OK)
        follow(&film, error);
    film_free(&film);
    return error->status;
}
