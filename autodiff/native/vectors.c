/* The beginning of every compiled program: vector types of `lanes` elements, as gcc and clang
   provide them, and the operations on them.

   Operations are the expressions of ops.def, as text; those that choose between two values are
   written again here, because ?: does not work lane by lane in C. Mathematical functions are those
   of glibc's libmvec, as in kernels.c, called by name. In these texts @ stands for the number of
   lanes; one lane is a plain number. */
#include "native.h"

#include <math.h>
#include <string.h>

/* Multiply-adds are contracted, which rounds once instead of twice and saves a fifth of a pair law;
   by gcc without being told. */
static const char for_all[] =
    "#ifdef __clang__\n#pragma clang fp contract(fast)\n#endif\n"
    "#define PASTE(a, b) a##b\n"
    "#define JOIN(a, b) PASTE(a, b)\n"
    "#define COPY __builtin_memcpy\n"
    /* an index opaque to the compiler: one register for all addresses, and loops are not unrolled
     */
    "#define OPAQUE(c) __asm__(\"\" : \"+r\"(c))\n"
    "typedef unsigned u32;\n"
    "typedef __SIZE_TYPE__ size_t;\n";

static const char for_f64[] = "typedef double R;\n"
                              "typedef long long I;\n"
                              "#define LIBM(name) name\n"
                              "#define SQRT \"sqrtpd\"\n"
                              "#define ALIGN \"valignq $7,\"\n"
                              "#if defined __AVX512DQ__ && defined __AVX512VL__\n"
                              "#define NEWTON \"=@ccnz\" /* output of flags */\n"
                              "#endif\n";
static const char for_f32[] = "typedef float R;\n"
                              "typedef int I;\n"
                              "#define LIBM(name) name##f\n"
                              "#define SQRT \"sqrtps\"\n"
                              "#define ALIGN \"valignd $15,\"\n";

/* on: the lanes of the last vector that the one before does not have. D: sums are in double. */
static const char for_vectors[] =
    "typedef R V@ __attribute__((vector_size(@ * sizeof(R))));\n"
    "typedef I I@ __attribute__((vector_size(@ * sizeof(R))));\n"
    "typedef double D@ __attribute__((vector_size(@ * sizeof(double))));\n"
    "static const I steps@[2 * @] = {[@ ... 2 * @ - 1] = -1};\n"
    "typedef R U@ __attribute__((vector_size(@ * sizeof(R)), aligned(1), may_alias));\n"
    "#define load@(p) ((V@)*(const U@ *)(p))\n"
    "#define store@(p, v) (*(U@ *)(p) = (v))\n"
    "static inline V@ ahead@(const char *p) { __builtin_prefetch(p + 2048); return load@(p); }\n"
    "#ifdef __AVX__\n"
    "static inline void stream@(char *p, V@ v) { if ((size_t)p % sizeof v) store@(p, v);"
    " else __asm__(\"vmovntps %1, %0\" : \"=m\"(*(U@ *)p) : \"v\"(v)); }\n"
    "#else\n"
    "#define stream@ store@\n"
    "#endif\n"
    "#ifdef __clang__\n"
    "#define SHUFFLE@(a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)\n"
    "#else\n"
    "#define SHUFFLE@(a, b, ...) __builtin_shuffle(a, b, (I@){__VA_ARGS__})\n"
    "#endif\n"
    "static inline V@ splat@(const char *p) { R x; COPY(&x, p, sizeof x); return x - (V@){0}; }\n"
    "static inline V@ all@(R x) { return x - (V@){0}; }\n"
    "static inline I@ on@(size_t done) { I@ m; COPY(&m, steps@ + @ - done, sizeof m); return m; }\n"
    "static inline V@ only@(I@ m, V@ v) { return (V@)((I@)v & m); }\n"
    "static inline I@ columns@(size_t c)"
    " { I@ i; COPY(&i, numbers, sizeof i); return i + (I)c; }\n"
    "static inline V@ pick@(I@ m, V@ a, V@ b)"
    " { return (V@)((m & (I@)a) | (~m & (I@)b)); }\n"
    "static inline V@ one@(I@ m) { return (V@)(m & (I@)(1 - (V@){0})); }\n"
    "static inline D@ wide@(V@ v) { return __builtin_convertvector(v, D@); }\n"
    "static inline double across@(D@ v) { double s = 0; for (int l = 0; l < @; l++) s += v[l];"
    " return s; }\n"
    /* for code outside the loop over vectors: inlining hundreds of these takes the compiler seconds
     */
    "static __attribute__((noinline)) double total@(D@ v) { return across@(v); }\n"
    "static inline V@ rows@(const char *p, const u32 *list, size_t step) { V@ v;"
    " for (int l = 0; l < @; l++) COPY((R *)&v + l, p + list[l] * step, sizeof(R)); return v; }\n"
    "static inline V@ strided@(const char *p, size_t step) { V@ v;"
    " for (int l = 0; l < @; l++) COPY((R *)&v + l, p + l * step, sizeof(R)); return v; }\n"
    "static inline void scatter@(char *p, const u32 *list, size_t step, V@ v, size_t done) {"
    " for (size_t l = done; l < @; l++) { char *to = p + list[l] * step; R x;"
    " COPY(&x, to, sizeof x); x += v[l]; COPY(to, &x, sizeof x); } }\n"
    "static inline V@ fabs_@(V@ x) { return (V@)((I@)x & ~(I@)-(V@){0}); }\n"
    "#if defined __AVX__\n"
    "static inline V@ sqrt_@(V@ x) { V@ y; __asm__(\"v\" SQRT \" %1, %0\" : \"=v\"(y) : \"v\"(x));"
    " return y; }\n"
    "#elif defined __SSE2__\n"
    "static inline V@ sqrt_@(V@ x) { V@ y; __asm__(SQRT \" %1, %0\" : \"=x\"(y) : \"x\"(x));"
    " return y; }\n"
    "#else\n"
    "static inline V@ sqrt_@(V@ x) { for (int l = 0; l < @; l++)"
    " x[l] = LIBM(__builtin_sqrt)(x[l]); return x; }\n"
    "#endif\n"
    "static inline V@ op_powi_@(V@ a, V@ b)"
    " { for (int l = 0; l < @; l++) a[l] = whole_1(a[l], (int)b[l]); return a; }\n";

/* A lane alone. */
static const char for_numbers[] =
    "static const I numbers[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};\n"
    "typedef R V1;\n"
    "typedef int I1;\n"
    "typedef double D1;\n"
    "static inline R load1(const char *p) { R v; COPY(&v, p, sizeof v); return v; }\n"
    "static inline void store1(char *p, R v) { COPY(p, &v, sizeof v); }\n"
    "static inline R splat1(const char *p) { return load1(p); }\n"
    "static inline R all1(R x) { return x; }\n"
    "static inline I columns1(size_t c) { return (I)c; }\n"
    "static inline R only1(int m, R v) { return m ? v : 0; }\n"
    "static inline R pick1(int m, R a, R b) { return m ? a : b; }\n"
    "static inline R one1(int m) { return (R)m; }\n"
    "static inline double wide1(R v) { return (double)v; }\n"
    "#define across1(v) (v)\n"
    "#define total1(v) (v)\n"
    "static inline void scatter1(char *p, const u32 *list, size_t step, R v, size_t done) {"
    " char *to = p + list[0] * step; store1(to, load1(to) + v); }\n"
    "static inline R fabs_1(R x) { return LIBM(__builtin_fabs)(x); }\n"
    "static inline R sqrt_1(R x) { return LIBM(__builtin_sqrt)(x); }\n"
    "#define op_powi_1(a, b) whole_1(a, (int)(b))\n";

/* a^n for whole |n| <= 32, the products of kernels.c. */
static const char whole_power[] = "static inline V@ whole_@(V@ a, int n) {"
                                  " V@ y = all@(1), s = a; int m = n < 0 ? -n : n;\n"
                                  "#pragma GCC unroll 6\n"
                                  " for (int bit = 0; bit < 6; bit++)"
                                  " { if (m >> bit & 1) y *= s; s *= s; }"
                                  " return n < 0 ? 1 / y : y; }\n";

/* ---- reciprocals and square roots ---- */

/* Any lane of x that is not below the limit. */
static const char compared[] =
    "#ifdef NEWTON\n"
    "static inline int not_below@(V@ x, V@ limit) { int any;"
    " __asm__(\"vcmppd $0x15, %2, %1, %%k1\\n\\tkortestb %%k1, %%k1\" : NEWTON(any)"
    " : \"v\"(x), \"v\"(limit) : \"k1\"); return any; }\n"
    "#else\n"
    "typedef signed char B@ __attribute__((vector_size(@)));\n"
    "static inline int not_below@(V@ x, V@ limit) { const B@ not ="
    " __builtin_convertvector(~(x < limit), B@); long long any = 0;"
    " COPY(&any, &not, sizeof not); return any != 0; }\n"
    "#endif\n";

/* AVX-512 has 1/x and 1/sqrt(x) to 14 bits, and correcting them takes a third of the time of a
   division: e, what is left of 1 - x y or 1 - x y^2, is at most 2^-12.9, and series in e end where
   rounding begins. With g = x y rounded, e = 1 - g y and the root g (1 - e)^(-1/2) have half the
   error of g. Errors in tests/autodiff/native/test_newton.c. Where x is 0, infinite, negative, or
   so small that 1/x is infinite, both are NaN and left to the instructions for division and root.
 */
static const char newton[] =
    "#ifdef NEWTON\n"
    "struct newton@ { V@ root, recip; };\n"
    "static inline struct newton@ newton_recip@(V@ x) { V@ y;"
    " __asm__(\"vrcp14pd %1, %0\" : \"=v\"(y) : \"v\"(x)); const V@ e = 1 - x * y;"
    " struct newton@ s; s.recip = y + y * (e + e * (e + e * e)); return s; }\n"
    "static inline struct newton@ newton_root@(V@ x) { V@ y;"
    " __asm__(\"vrsqrt14pd %1, %0\" : \"=v\"(y) : \"v\"(x)); const V@ g = x * y, e = 1 - g * y,"
    " t = e * (0.5 + e * (0.375 + e * (0.3125 + e * 0.2734375)));"
    " struct newton@ s; s.root = g + g * t; s.recip = y + y * t; return s; }\n"
    "static inline int nan@(V@ a, V@ b, V@ c, V@ d) { int any;"
    " __asm__(\"vcmpunordpd %2, %1, %%k1\\n\\tvcmpunordpd %4, %3, %%k2\\n\\tkortestb %%k2, %%k1\""
    " : NEWTON(any) : \"v\"(a), \"v\"(b), \"v\"(c), \"v\"(d) : \"k1\", \"k2\"); return any; }\n"
    "static inline V@ divide@(V@ x, int zero) { V@ y; const V@ one = all@(1); __asm__ volatile("
    "\"vdivpd %2, %1, %0\" : \"=v\"(y) : \"v\"(one), \"v\"(x));"
    " return zero ? only@(x != 0, y) : y; }\n"
    "static inline struct newton@ exact_recip@(struct newton@ s, V@ x, int zero) {"
    " s.recip = pick@(s.recip != s.recip, divide@(x, zero), s.recip); return s; }\n"
    "static inline struct newton@ exact_root@(struct newton@ s, V@ x, int zero) { V@ root;"
    " __asm__ volatile(\"vsqrtpd %1, %0\" : \"=v\"(root) : \"v\"(x));"
    " s.root = pick@(s.recip != s.recip, root, s.root);"
    " s.recip = pick@(s.recip != s.recip, divide@(root, zero), s.recip); return s; }\n"
    "#endif\n";

/* ---- operations ---- */

/* Expressions of ops.def that are C for scalars only. PICK, ONLY, ONE: lane by lane c ? a : b, c ?
   a : 0, c ? 1 : 0. */
static const struct {
    enum ad_op op;
    const char *value;
} chosen[] = {
    {AD_OP_sign, "ONE(x > 0) - ONE(x < 0)"},
    {AD_OP_step, "ONE(x > 0)"},
    {AD_OP_recip0, "ONLY(x != 0, 1 / x)"},
    {AD_OP_softplus, "ONLY(x > 0, x) + F(log1p)(F(exp)(-F(fabs)(x)))"},
    {AD_OP_relu, "ONLY((x > 0) | (x != x), x)"},
    {AD_OP_mul0, "ONLY((a != 0) & (b != 0), a * b)"},
    {AD_OP_powi, ""}, /* stands with the vectors */
    {AD_OP_min, "PICK((a <= b) | (a != a), a, b)"},
    {AD_OP_max, "PICK((a >= b) | (a != a), a, b)"},
    {AD_OP_lt, "ONE(a < b)"},
    {AD_OP_le, "ONE(a <= b)"},
    {AD_OP_eq, "ONE(a == b)"},
    {AD_OP_ne, "ONE(a != b)"},
    {AD_OP_select, "PICK(a != 0, b, c)"},
};

static const char *const values[AD_N_OPS] = {
#define AD_UNARY(name, value, dx, lo, hi) [AD_OP_##name] = #value,
#define AD_BINARY(name, value, da, db, lo, hi) [AD_OP_##name] = #value,
#define AD_TERNARY(name, value, da, db, dc, lo, hi) [AD_OP_##name] = #value,
#include "autodiff/ops.def"
};

static const char *value_text(enum ad_op op)
{
    for (size_t k = 0; k < LENGTH(chosen); k++)
        if (chosen[k].op == op)
            return chosen[k].value;
    return values[op];
}

static void write_operation(FILE *out, enum ad_op op, uint32_t lanes)
{
    static const char *const arguments[] = {"", "V x", "V a, V b", "V a, V b, V c"};
    static const char *const names[] = {"", "x", "a, b", "a, b, c"};
    const char *value = value_text(op);
    if (!value || !*value)
        return;
    bool calls = strpbrk(value, "FOP");
    fprintf(out,
            calls ? "static inline V op_%s_%u(%s) { return %s; }\n" : "#define op_%s_%u(%s) (%s)\n",
            ad_op_name(op), lanes, (calls ? arguments : names)[ad_ops[op].arity], value);
}

/* The vector a lane further, behind the last lane of the one before, which is at p. */
static void write_shift(FILE *out, uint32_t lanes)
{
    fprintf(out,
            "static inline V%u shift%u(const char *p, V%u v) {\n"
            "#ifdef __AVX512F__\n"
            "if (sizeof v == 64) { V%u y; __asm__(ALIGN \" %%2, %%1, %%0\" : \"=v\"(y)"
            " : \"v\"(v), \"m\"(*(const U%u *)p)); return y; }\n"
            "#endif\n"
            "return SHUFFLE%u(load%u(p), v",
            lanes, lanes, lanes, lanes, lanes, lanes, lanes);
    for (uint32_t l = 0; l < lanes; l++)
        fprintf(out, ", %u", lanes - 1 + l);
    fputs("); }\n", out);
}

/* ---- mathematical functions ---- */

struct function {
    const char *name;
    int arity;
    bool vector; /* has a vector version */
};

#ifndef __GLIBC_PREREQ /* another C library: no vectors at all */
#define __GLIBC_PREREQ(major, minor) 0
#endif
#define NEVER 1000

static const struct function functions[] = {
#define AD_VECTOR(name, arity, since) {#name, arity, __GLIBC_PREREQ(2, since)},
#include "autodiff/ops.def"
};

/* glibc's letter for the instruction set with registers of this size; 0: no functions. */
static char vector_letter(const ad_program *p, size_t bytes)
{
#if defined(__GLIBC__) && defined(__x86_64__)
    bool avx = strcmp(p->kernels->isa, "base") != 0;
    return bytes == 16 ? 'b' : bytes == 32 && avx ? 'd' : bytes == 64 && avx ? 'e' : 0;
#else
    (void)p, (void)bytes;
    return 0;
#endif
}

static void write_function(FILE *out, const ad_program *p, const struct function *f, uint32_t lanes)
{
    char letter = f->vector && lanes > 1 ? vector_letter(p, lanes * p->element) : 0;
    const char *type = p->type == AD_F32 ? "f" : "", *more = f->arity > 1 ? ", V" : "";
    if (lanes == 1) {
        fprintf(out, "R %s%s(R%s);\n#define %s_1 %s%s\n", f->name, type, f->arity > 1 ? ", R" : "",
                f->name, f->name, type);
    } else if (letter) {
        char name[64];
        snprintf(name, sizeof name, "_ZGV%cN%u%s_%s%s", letter, lanes, f->arity > 1 ? "vv" : "v",
                 f->name, type);
        fprintf(out, "V %s(V%s) __attribute__((const));\n#define %s_%u %s\n", name, more, f->name,
                lanes, name);
    } else if (f->arity == 1) {
        fprintf(out,
                "static inline V %s_%u(V x) { for (int l = 0; l < %u; l++)"
                " x[l] = %s_1(x[l]); return x; }\n",
                f->name, lanes, lanes, f->name);
    } else {
        fprintf(out,
                "static inline V %s_%u(V a, V b) { for (int l = 0; l < %u; l++)"
                " a[l] = %s_1(a[l], b[l]); return a; }\n",
                f->name, lanes, lanes, f->name);
    }
}

/* ---- sine and cosine together ---- */

/* Sine and cosine of one argument share its reduction to [-pi/4, pi/4], r = x - k pi/2 with pi/2 in
   three parts (Cody, Waite), whose products but the last are exact; `off` is what rounding adds to
   r. The polynomials are those of fdlibm (Sun Microsystems, 1993: k_sin.c, k_cos.c). Below 1 ulp up
   to 1e5 (tests/autodiff/native/test_newton.c), where libmvec has 3.4; beyond, libmvec does it.
   Inlined where there are few: a call saves all vectors and loads all constants. */
static const char sine_and_cosine[] =
    "struct both@ { V@ sin, cos; };\n"
    "static inline struct both@ circle@(V@ x)\n{\n"
    "const V@ up = all@(0x1.8p52), t = x * 0x1.45f306dc9c883p-1 + up, k = t - up;\n"
    "const I@ n = (I@)t;\n"
    "#ifdef __FMA__\n"
    "const V@ near = x - k * 0x1.921fb54442d18p0, r = near - k * 0x1.1a626331p-54;\n"
    "const V@ off = r - near + k * 0x1.1a626331p-54 + k * 0x1.1701b839a252p-88;\n"
    "#else\n"
    "const V@ far = x - k * 0x1.921fb544p0, near = far - k * 0x1.0b4611a6p-34;\n"
    "const V@ rest = k * 0x1.3198a2e037073p-69, r = near - rest;\n"
    "const V@ off = r - near + rest - (far - near - k * 0x1.0b4611a6p-34);\n"
    "#endif\n"
    "const V@ z = r * r, zr = z * r;\n"
    "V@ s = r - (off - zr * (-1.66666666666666324348e-01 + z * (8.33333333332248946124e-03"
    " + z * (-1.98412698298579493134e-04 + z * (2.75573137070700676789e-06"
    " + z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10))))));\n"
    "const V@ q = 4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03"
    " + z * (2.48015872894767294178e-05 + z * (-2.75573143513506633035e-07"
    " + z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11))));\n"
    "#ifdef __FMA__\n"
    "V@ c = 1 - r * (0.5 * r - (off + zr * q));\n"
    "#else\n" /* r times that would be rounded */
    "const V@ h = 0.5 * z, w = 1 - h;\n"
    "V@ c = w + (1 - w - h + (r * off + z * z * q));\n"
    "#endif\n"
    /* odd k: the sine is c, the cosine -s; then the sign of both is bit 1 of k */
    "const I@ minus = (I@)all@(-0.0), half = n << 62;\n"
    "#ifdef NEWTON\n"
    "V@ first; __asm__(\"vptestmq %3, %2, %%k1\\n\\tvblendmpd %1, %4, %0%{%%k1%}\\n\\t"
    "vxorpd %5, %4, %1%{%%k1%}\\n\\tvpternlogq $0x78, %5, %6, %0\\n\\t"
    "vpternlogq $0x78, %5, %6, %1\" : \"=&v\"(first), \"+&v\"(c)"
    " : \"v\"(n), \"v\"((I@){0} + 1), \"v\"(s), \"v\"(minus), \"v\"(half) : \"k1\");\n"
    "return (struct both@){first, c};\n}\n"
    "#else\n"
    "const I@ odd = -(n & 1), swap = ((I@)s ^ (I@)c) & odd, sign = half & minus;\n"
    "s = (V@)((I@)s ^ swap); c = (V@)((I@)c ^ swap ^ (odd & minus));\n"
    "return (struct both@){(V@)((I@)s ^ sign), (V@)((I@)c ^ sign)};\n}\n"
    "#endif\n"
    "static __attribute__((noinline, cold)) struct both@ far_circle@(V@ x)\n{\n"
    "const struct both@ near = circle@(x);\n"
    "const I@ far = ~(fabs_@(x) < all@(1e5));\n"
    "return (struct both@){pick@(far, sin_@(x), near.sin), pick@(far, cos_@(x), near.cos)};\n}\n"
    "static inline struct both@ sincos@(V@ x)\n{\n"
    "if (__builtin_expect(not_below@(fabs_@(x), all@(1e5)), 0)) return far_circle@(x);\n"
    "return circle@(x);\n}\n";

/* ---- the prologue ---- */

static void fill_in(FILE *out, const char *text, uint32_t lanes)
{
    for (; *text; text++)
        if (*text == '@')
            fprintf(out, "%u", lanes);
        else
            fputc(*text, out);
}

void ad_native_vectors(FILE *out, const ad_program *p, uint32_t lanes)
{
    if (lanes == 1) { /* comes first, in every program */
        fputs(for_all, out);
        fputs(p->type == AD_F32 ? for_f32 : for_f64, out);
        fputs(for_numbers, out);
        fill_in(out, whole_power, 1);
    } else {
        fill_in(out, for_vectors, lanes);
        write_shift(out, lanes);
        if (p->type == AD_F64) {
            fill_in(out, compared, lanes);
            fill_in(out, newton, lanes);
        }
        fill_in(out, whole_power, lanes);
    }
    fill_in(out,
            "#define V V@\n#define F(name) name##_@\n#define PICK pick@\n#define ONE one@\n"
            "#define ONLY only@\n",
            lanes);
    for (size_t k = 0; k < LENGTH(functions); k++)
        write_function(out, p, &functions[k], lanes);
    if (p->type == AD_F64 && lanes > 1)
        fill_in(out, sine_and_cosine, lanes);
    for (int op = 0; op < AD_N_OPS; op++)
        if (ad_ops[op].elementwise)
            write_operation(out, (enum ad_op)op, lanes);
    fputs("#undef V\n#undef F\n#undef PICK\n#undef ONE\n#undef ONLY\n", out);
}

size_t ad_native_vector_bytes(const ad_program *p)
{
    return strcmp(p->kernels->isa, "avx512") == 0 ? 64
           : strcmp(p->kernels->isa, "avx2") == 0 ? 32
                                                  : 16;
}
