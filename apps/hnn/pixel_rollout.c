/* `leastaction rollout` of models of pixels (pixel_rollout.h): the order of things. */
#include "pixel_rollout.h"

static enum ad_status write_results(const struct film *film, struct outputs *outputs,
                                    struct ad_error *error)
{
    struct report report = {0};
    film_report(film, &report);
    if (outputs->file)
        film_file(film, &report, outputs->file, error);
    if (outputs->csv.out)
        film_write_csv(film, outputs->csv.out);
    if (outputs->plot.script && error->status == AD_OK)
        film_picture(film, &outputs->plot, error);
    return outputs_finish(outputs, &film->options->common, &report, error);
}

static enum ad_status run_film(struct film *film, struct ad_error *error)
{
    struct outputs outputs;
    if (outputs_begin(&film->options->common, &outputs, error) != AD_OK)
        return error->status;
    if (film_run(film, error) == AD_OK)
        return write_results(film, &outputs, error);
    outputs_abandon(&outputs);
    return error->status;
}

enum ad_status film_rollout(const struct rollout_options *options, hnn_model *model,
                            struct ad_error *error)
{
    struct film film;
    if (film_setup(options, model, &film, error) == AD_OK)
        run_film(&film, error);
    film_free(&film);
    return error->status;
}
