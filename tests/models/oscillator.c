/* A damped oscillator as an FMU for co-simulation. Each step is exact. */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdlib.h>

typedef void Log2(void *, const char *, int, const char *, const char *, ...);
typedef void Log3(void *, int, const char *, const char *);

/* Value references: 0 mass, 1 stiffness, 2 damping, 3 x0, 4 force, 5 x, 6 v, 7 k_over_m,
   8 guess, which initialization replaces by 1; integers and booleans: 0 springs, 1 locked. */
typedef struct {
  double value[12];
  int springs, locked;
  double t;
  void *environment;
  Log2 *log2;
  Log3 *log3;
} Model;

static Model *new_model(void) {
  Model *m = calloc(1, sizeof(Model));
  m->value[0] = 1.0, m->value[1] = 100.0, m->value[2] = 2.0, m->value[3] = 1.0;
  m->springs = 1;
  return m;
}

static void initialize(Model *m) {
  m->value[5] = m->value[3], m->value[6] = 0.0;
  m->value[7] = m->value[1] / m->value[0];
  m->value[8] = 1.0;
}

static int advance(Model *m, double t, double h) {
  double mass = m->value[0], k = m->value[1] * m->springs;
  if (fabs(t - m->t) > 1e-9) return 3; /* steps must follow each other */
  if (k < 0) {
    if (m->log2) m->log2(NULL, "osc", 3, "error", "stiffness %s", "is negative");
    if (m->log3) m->log3(m->environment, 3, "error", "stiffness is negative");
    return 3;
  }
  m->t = t + h;
  if (m->locked) return 0;
  double rest = m->value[4] / k, decay = m->value[2] / (2 * mass);
  double omega = sqrt(k / mass - decay * decay), e = exp(-decay * h);
  double x = m->value[5] - rest, v = m->value[6], s = sin(omega * h) / omega, c = cos(omega * h);
  m->value[5] = rest + e * (x * (c + decay * s) + v * s);
  m->value[6] = e * (v * (c - decay * s) - x * s * (omega * omega + decay * decay));
  return 0;
}

static int get(Model *m, const unsigned *vr, size_t n, double *value) {
  for (size_t i = 0; i < n; i++) value[i] = m->value[vr[i]];
  return 0;
}

static int set(Model *m, const unsigned *vr, size_t n, const double *value) {
  for (size_t i = 0; i < n; i++) m->value[vr[i]] = value[i];
  return 0;
}

#ifdef FMI2
void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                      void **callbacks, int visible, int logging) {
  Model *m = new_model();
  m->log2 = (Log2 *)callbacks[0];
  return m;
}
void fmi2FreeInstance(Model *m) { free(m); }
int fmi2SetupExperiment(Model *m, int d, double tol, double t, int s, double end) {
  m->t = t;
  return 0;
}
int fmi2EnterInitializationMode(Model *m) { return 0; }
int fmi2ExitInitializationMode(Model *m) { return initialize(m), 0; }
int fmi2GetReal(Model *m, const unsigned *vr, size_t n, double *v) { return get(m, vr, n, v); }
int fmi2SetReal(Model *m, const unsigned *vr, size_t n, const double *v) {
  return set(m, vr, n, v);
}
int fmi2GetInteger(Model *m, const unsigned *vr, size_t n, int *v) { return *v = m->springs, 0; }
int fmi2SetInteger(Model *m, const unsigned *vr, size_t n, int *v) { return m->springs = *v, 0; }
int fmi2GetBoolean(Model *m, const unsigned *vr, size_t n, int *v) { return *v = m->locked, 0; }
int fmi2SetBoolean(Model *m, const unsigned *vr, size_t n, int *v) { return m->locked = *v, 0; }
int fmi2DoStep(Model *m, double t, double h, int n) { return advance(m, t, h); }
#else
void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources,
                                  bool visible, bool logging, bool events, bool early,
                                  const unsigned *required, size_t n, void *environment, Log3 *log,
                                  void *update) {
  Model *m = new_model();
  m->log3 = log, m->environment = environment;
  return m;
}
void fmi3FreeInstance(Model *m) { free(m); }
int fmi3EnterInitializationMode(Model *m, bool d, double tol, double t, bool s, double end) {
  m->t = t;
  return 0;
}
int fmi3ExitInitializationMode(Model *m) { return initialize(m), 0; }
int fmi3GetFloat64(Model *m, const unsigned *vr, size_t n, double *v, size_t nv) {
  return get(m, vr, n, v);
}
int fmi3SetFloat64(Model *m, const unsigned *vr, size_t n, const double *v, size_t nv) {
  return set(m, vr, n, v);
}
int fmi3GetInt32(Model *m, const unsigned *vr, size_t n, int *v, size_t nv) {
  return *v = m->springs, 0;
}
int fmi3SetInt32(Model *m, const unsigned *vr, size_t n, int *v, size_t nv) {
  return m->springs = *v, 0;
}
int fmi3GetBoolean(Model *m, const unsigned *vr, size_t n, bool *v, size_t nv) {
  return *v = m->locked, 0;
}
int fmi3SetBoolean(Model *m, const unsigned *vr, size_t n, bool *v, size_t nv) {
  return m->locked = *v, 0;
}
int fmi3DoStep(Model *m, double t, double h, bool n, bool *event, bool *end, bool *early,
               double *last) {
  int status = advance(m, t, h);
  *event = *early = false, *last = m->t;
  *end = m->t > 4.95;
  return status;
}
#endif
