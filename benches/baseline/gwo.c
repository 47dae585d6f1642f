/* The Grey Wolf Optimizer on one recording in C: blocks of candidates in vectors, threads of OpenMP, every cost computed.
 *
 *   cc -O3 -march=native -fno-math-errno -fno-trapping-math -mprefer-vector-width=512 -fopenmp gwo.c -o gwo -lm
 *   ./gwo RECORDING.csv RUNS        median time of a search of 100 agents and 100 generations [ms]
 *
 * With -DLIBRARY it is a shared library with the function `costs`. Criterion nrmse with scale std, zero-order hold, bounds of
 * Table 2 of the paper, rules of `optimize/gwo.rs`: Eqs. 8 to 10. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { LANES = 24, PARAMETERS = 5 };

typedef struct {
    long samples, first; /* all samples before `first` have no input */
    double step;
    const double *voltage, *current, *speed;
    double weight[2], before; /* of the squares of current and speed; their weighted sum before `first` */
} recording;

/* Writes the step map of a zero-order hold: state matrix row by row, then the gains. */
static void step_map(const double *p, double h, double map[6])
{
    double r = p[0], l = p[1], k = p[2], b = p[3], j = p[4];
    double mean = -0.5 * (r / l + b / j), half = 0.5 * (b / j - r / l), square = half * half - k * k / (l * j);
    double root = sqrt(fabs(square)) * h, grow = exp(mean * h), c, s;
    if (root < 1e-4) {
        c = grow;
        s = grow * h;
    } else if (square > 0) {
        c = grow * cosh(root);
        s = grow * sinh(root) * h / root;
    } else {
        c = grow * cos(root);
        s = grow * sin(root) * h / root;
    }
    map[0] = c + half * s;
    map[1] = -k / l * s;
    map[2] = k / j * s;
    map[3] = c - half * s;
    double determinant = (r * b + k * k) / (l * j), one = (map[0] - 1) / l, two = map[2] / l;
    map[4] = (-b / j * one + k / l * two) / determinant;
    map[5] = (-r / l * two - k / j * one) / determinant;
}

/* Writes the costs of `count` candidates, rows of five parameters. */
void costs(const recording *of, const double *candidates, long count, double *out)
{
#pragma omp parallel for schedule(static)
    for (long start = 0; start < count; start += LANES) {
        double map[6][LANES], i[LANES] = {0}, w[LANES] = {0}, sum_i[LANES] = {0}, sum_w[LANES] = {0};
        for (long n = 0; n < LANES; n++) {
            double own[6];
            long row = start + n < count ? start + n : count - 1;
            step_map(candidates + PARAMETERS * row, of->step, own);
            for (int m = 0; m < 6; m++) map[m][n] = own[m];
        }
        for (long t = of->first; t < of->samples; t++) {
            double v = of->voltage[t], measured_i = of->current[t], measured_w = of->speed[t];
#pragma omp simd
            for (int n = 0; n < LANES; n++) {
                double one = measured_i - i[n], two = measured_w - w[n];
                sum_i[n] += one * one;
                sum_w[n] += two * two;
                double next = map[0][n] * i[n] + (map[1][n] * w[n] + map[4][n] * v);
                w[n] = map[2][n] * i[n] + (map[3][n] * w[n] + map[5][n] * v);
                i[n] = next;
            }
        }
        for (long n = 0; n < LANES && start + n < count; n++) {
            double cost = sqrt(of->before + of->weight[0] * sum_i[n] + of->weight[1] * sum_w[n]);
            out[start + n] = cost < 1e30 ? cost : INFINITY;
        }
    }
}

#ifndef LIBRARY
static uint64_t state[2];

/* xoroshiro128+, in [0, 1) */
static double uniform(void)
{
    uint64_t a = state[0], b = state[1], sum = a + b;
    b ^= a;
    state[0] = ((a << 24) | (a >> 40)) ^ b ^ (b << 16);
    state[1] = (b << 37) | (b >> 27);
    return (sum >> 11) * 0x1p-53;
}

enum { AGENTS = 100, GENERATIONS = 100 };
static const double LOW[] = {0.1, 1e-3, 5e-3, 1e-5, 1e-5}, HIGH[] = {1, 0.1, 0.1, 1e-3, 1e-3};

static double search(const recording *of, uint64_t seed)
{
    double agents[AGENTS][PARAMETERS], found[AGENTS], leaders[3][PARAMETERS], best[3] = {INFINITY, INFINITY, INFINITY};
    state[0] = seed * 0x9e3779b97f4a7c15u + 1;
    state[1] = seed ^ 0xd1b54a32d192ed03u;
    for (int n = 0; n < 10; n++) uniform();
    for (int n = 0; n < AGENTS; n++)
        for (int p = 0; p < PARAMETERS; p++) agents[n][p] = LOW[p] + uniform() * (HIGH[p] - LOW[p]);
    for (int generation = 0; generation < GENERATIONS; generation++) {
        costs(of, agents[0], AGENTS, found);
        for (int n = 0; n < AGENTS; n++)
            for (int place = 0; place < 3; place++)
                if (found[n] < best[place]) {
                    memmove(best + place + 1, best + place, (2 - place) * sizeof *best);
                    memmove(leaders + place + 1, leaders + place, (2 - place) * sizeof *leaders);
                    best[place] = found[n];
                    memcpy(leaders[place], agents[n], sizeof *leaders);
                    break;
                }
        double a = 2 - 2.0 * generation / GENERATIONS;
        for (int n = 0; n < AGENTS; n++)
            for (int p = 0; p < PARAMETERS; p++) {
                double sum = 0;
                for (int of_leader = 0; of_leader < 3; of_leader++) {
                    double towards = leaders[of_leader][p], spread = a * (2 * uniform() - 1), around = 2 * uniform();
                    sum += towards - spread * fabs(around * towards - agents[n][p]);
                }
                double next = sum / 3;
                agents[n][p] = next < LOW[p] ? LOW[p] : next > HIGH[p] ? HIGH[p] : next;
            }
    }
    return best[0];
}

static int ascending(const void *a, const void *b)
{
    double one = *(const double *)a, two = *(const double *)b;
    return (one > two) - (one < two);
}

static double mean_square_about_mean(const double *values, long count)
{
    double sum = 0, squares = 0;
    for (long n = 0; n < count; n++) sum += values[n];
    for (long n = 0; n < count; n++) squares += (values[n] - sum / count) * (values[n] - sum / count);
    return squares / count;
}

int main(int argc, char **argv)
{
    enum { MOST = 1 << 20 };
    double *column[4];
    for (int c = 0; c < 4; c++) column[c] = malloc(MOST * sizeof(double));
    FILE *file = argc > 2 ? fopen(argv[1], "r") : NULL;
    if (!file) return fprintf(stderr, "usage: gwo RECORDING.csv RUNS (columns time, voltage, current, speed)\n"), 2;
    long samples = 0, first = 0;
    if (fscanf(file, "%*[^\n]") == EOF) return 2;
    while (samples < MOST && fscanf(file, "%lf,%lf,%lf,%lf", column[0] + samples, column[1] + samples, column[2] + samples,
                                    column[3] + samples) == 4)
        samples++;
    fclose(file);
    while (first < samples && column[1][first] == 0) first++;
    int runs = atoi(argv[2]);
    if (runs < 1 || samples < 2) return fprintf(stderr, "expected a run or more and two samples or more\n"), 2;
    recording of = {samples, first, column[0][1] - column[0][0], column[1], column[2], column[3], {0, 0}, 0};
    for (int c = 0; c < 2; c++) {
        of.weight[c] = 1 / (samples * mean_square_about_mean(column[2 + c], samples));
        for (long n = 0; n < first; n++) of.before += of.weight[c] * column[2 + c][n] * column[2 + c][n];
    }
    double *times = malloc((runs + 1) * sizeof(double)), best = INFINITY;
    for (int run = 0; run <= runs; run++) {
        struct timespec from, to;
        clock_gettime(CLOCK_MONOTONIC, &from);
        double cost = search(&of, run + 1);
        clock_gettime(CLOCK_MONOTONIC, &to);
        times[run] = 1e3 * (to.tv_sec - from.tv_sec) + 1e-6 * (to.tv_nsec - from.tv_nsec);
        if (cost < best) best = cost;
    }
    qsort(times + 1, runs, sizeof(double), ascending); /* the first run starts the threads */
    printf("%.4f ms, lowest cost %.6f\n", times[1 + runs / 2], best);
    return 0;
}
#endif
