/* The functions of FMI that the importer calls, for the version FMI. Included by proxy.c. */

#define VARIABLES Handle c, const Reference vr[], size_t n
#define REFERENCES V(c), I(vr, n), V(n)

FUNCTION(SetDebugLogging, (Handle c, Boolean on, size_t n, const String names[]), V(c), V(on), V(n),
         strings(names, n))
FUNCTION(SetTime, (Handle c, double time), V(c), D(time))
FUNCTION(SetContinuousStates, (Handle c, const double x[], size_t n), V(c), I(x, n), V(n))
FUNCTION(GetContinuousStates, (Handle c, double x[], size_t n), V(c), O(x, n), V(n))
FUNCTION(GetEventIndicators, (Handle c, double z[], size_t n), V(c), O(z, n), V(n))
FUNCTION(Terminate, (Handle c), V(c))

#if FMI < 3
#define ACCESSORS(NAME, TYPE)                                                                  \
    FUNCTION(Get##NAME, (VARIABLES, TYPE v[]), REFERENCES, O(v, n))                            \
    FUNCTION(Set##NAME, (VARIABLES, const TYPE v[]), REFERENCES, I(v, n))
ACCESSORS(Real, double)
ACCESSORS(Integer, int)
ACCESSORS(Boolean, Boolean)
FUNCTION(GetString, (VARIABLES, String v[]), REFERENCES, block(STRINGS_OUT, v, 0, n))
FUNCTION(SetString, (VARIABLES, const String v[]), REFERENCES, strings(v, n))
FUNCTION(SetRealInputDerivatives, (VARIABLES, const int order[], const double v[]), REFERENCES,
         I(order, n), I(v, n))
FUNCTION(GetRealOutputDerivatives, (VARIABLES, const int order[], double v[]), REFERENCES,
         I(order, n), O(v, n))
FUNCTION(GetDerivatives, (Handle c, double x[], size_t n), V(c), O(x, n), V(n))
FUNCTION(DoStep, (Handle c, double t, double h, Boolean f), V(c), D(t), D(h), V(f))
FUNCTION(GetRealStatus, (Handle c, int kind, double *v), V(c), V(kind), O(v, 1))
FUNCTION(GetBooleanStatus, (Handle c, int kind, Boolean *v), V(c), V(kind), O(v, 1))
typedef void (*Logger)(void *, String, int, String, String, ...);
#endif

#if FMI == 1
typedef struct {
    Logger logger;
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(Handle, int);
} Callbacks;
typedef struct {
    Boolean converged, references_changed, values_changed, ends, has_next;
    double next_event;
} EventInfo;

EXPORT String F(GetVersion)(void) { return "1.0"; }
EXPORT String F(GetTypesPlatform)(void) { return "standard32"; }
EXPORT String F(GetModelTypesPlatform)(void) { return "standard32"; }
EXPORT Handle F(InstantiateSlave)(String name, String guid, String location, String mime,
                                  double timeout, Boolean visible, Boolean interactive,
                                  Callbacks callbacks, Boolean logging) {
    Instance *m = add_instance(name);
    m->logger = callbacks.logger;
    if (!is_started()) return NULL;
    return complete(m, CALL(InstantiateSlave, text(name), text(guid), text(windows_path(location)),
                            text(mime), D(timeout), V(visible), V(interactive),
                            (Parameter){{CALLBACKS, m->key, 0, 0}, NULL}, V(logging)));
}
EXPORT Handle F(InstantiateModel)(String name, String guid, Callbacks callbacks, Boolean logging) {
    Instance *m = add_instance(name);
    m->logger = callbacks.logger;
    if (!is_started()) return NULL;
    return complete(m, CALL(InstantiateModel, text(name), text(guid),
                            (Parameter){{CALLBACKS, m->key, 0, 0}, NULL}, V(logging)));
}
EXPORT void F(FreeSlaveInstance)(Handle c) { CALL(FreeSlaveInstance, V(c)), forget(c); }
EXPORT void F(FreeModelInstance)(Handle c) { CALL(FreeModelInstance, V(c)), forget(c); }
FUNCTION(InitializeSlave, (Handle c, double start, Boolean has_stop, double stop), V(c), D(start),
         V(has_stop), D(stop))
FUNCTION(TerminateSlave, (Handle c), V(c))
FUNCTION(ResetSlave, (Handle c), V(c))
FUNCTION(CompletedIntegratorStep, (Handle c, Boolean *event), V(c), O(event, 1))
FUNCTION(Initialize, (Handle c, Boolean has, double tolerance, EventInfo *e), V(c), V(has),
         D(tolerance), block(DATA_INOUT, e, sizeof *e, 1))
FUNCTION(EventUpdate, (Handle c, Boolean intermediate, EventInfo *e), V(c), V(intermediate),
         block(DATA_INOUT, e, sizeof *e, 1))
FUNCTION(GetNominalContinuousStates, (Handle c, double x[], size_t n), V(c), O(x, n), V(n))
FUNCTION(GetStateValueReferences, (Handle c, Reference x[], size_t n), V(c), O(x, n), V(n))
#else
FUNCTION(ExitInitializationMode, (Handle c), V(c))
FUNCTION(EnterEventMode, (Handle c), V(c))
FUNCTION(EnterContinuousTimeMode, (Handle c), V(c))
FUNCTION(Reset, (Handle c), V(c))
FUNCTION(GetNominalsOfContinuousStates, (Handle c, double x[], size_t n), V(c), O(x, n), V(n))
FUNCTION(CompletedIntegratorStep, (Handle c, Boolean f, Boolean *event, Boolean *ends), V(c), V(f),
         O(event, 1), O(ends, 1))
EXPORT void F(FreeInstance)(Handle c) { CALL(FreeInstance, V(c)), forget(c); }
#endif

#if FMI == 2
typedef struct {
    Logger logger;
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, int);
    void *environment;
} Callbacks;
typedef struct {
    int again, ends, nominals_changed, values_changed, has_next;
    double next_event;
} EventInfo;

EXPORT String F(GetVersion)(void) { return "2.0"; }
EXPORT String F(GetTypesPlatform)(void) { return "default"; }
EXPORT Handle F(Instantiate)(String name, int type, String guid, String resources,
                             const Callbacks *callbacks, Boolean visible, Boolean logging) {
    Instance *m = add_instance(name);
    m->logger = callbacks->logger;
    m->environment = callbacks->environment;
    if (!is_started()) return NULL;
    Parameter own = {{CALLBACKS, m->key, 0, 0}, NULL};
    return complete(m, CALL(Instantiate, text(name), V(type), text(guid),
                            text(windows_path(resources)), own, V(visible), V(logging)));
}
FUNCTION(SetupExperiment,
         (Handle c, Boolean has, double tolerance, double start, Boolean has_stop, double stop),
         V(c), V(has), D(tolerance), D(start), V(has_stop), D(stop))
FUNCTION(EnterInitializationMode, (Handle c), V(c))
FUNCTION(NewDiscreteStates, (Handle c, EventInfo *e), V(c), block(DATA_INOUT, e, sizeof *e, 1))
FUNCTION(GetFMUstate, (Handle c, void **state), V(c), block(DATA_INOUT, state, sizeof *state, 1))
FUNCTION(SetFMUstate, (Handle c, void *state), V(c), V(state))
FUNCTION(FreeFMUstate, (Handle c, void **state), V(c), block(DATA_INOUT, state, sizeof *state, 1))
FUNCTION(GetDirectionalDerivative,
         (Handle c, const Reference u[], size_t nu, const Reference k[], size_t nk,
          const double dk[], double du[]),
         V(c), I(u, nu), V(nu), I(k, nk), V(nk), I(dk, nk), O(du, nu))
#endif

#if FMI == 3
#define ACCESSORS(NAME, TYPE)                                                                  \
    FUNCTION(Get##NAME, (VARIABLES, TYPE v[], size_t nv), REFERENCES, O(v, nv), V(nv))         \
    FUNCTION(Set##NAME, (VARIABLES, const TYPE v[], size_t nv), REFERENCES, I(v, nv), V(nv))
ACCESSORS(Float32, float)
ACCESSORS(Float64, double)
ACCESSORS(Int8, int8_t)
ACCESSORS(UInt8, uint8_t)
ACCESSORS(Int16, int16_t)
ACCESSORS(UInt16, uint16_t)
ACCESSORS(Int32, int32_t)
ACCESSORS(UInt32, uint32_t)
ACCESSORS(Int64, int64_t)
ACCESSORS(UInt64, uint64_t)
ACCESSORS(Boolean, bool)
FUNCTION(GetString, (VARIABLES, String v[], size_t nv), REFERENCES, block(STRINGS_OUT, v, 0, nv),
         V(nv))
FUNCTION(SetString, (VARIABLES, const String v[], size_t nv), REFERENCES, strings(v, nv), V(nv))
FUNCTION(GetBinary, (VARIABLES, size_t s[], const uint8_t *v[], size_t nv), REFERENCES, O(s, nv),
         block(BINARIES_OUT, v, 0, nv), V(nv))
FUNCTION(SetBinary, (VARIABLES, const size_t s[], const uint8_t *const v[], size_t nv), REFERENCES,
         I(s, nv), binaries(s, v, nv), V(nv))

EXPORT String F(GetVersion)(void) { return "3.0"; }
typedef void (*LogMessage)(void *, int, String, String);
static Parameter log_function(void) { return (Parameter){{LOG_FUNCTION, 0, 0, 0}, NULL}; }
EXPORT Handle F(InstantiateCoSimulation)(String name, String token, String resources, bool visible,
                                         bool logging, bool events, bool early,
                                         const Reference required[], size_t n, void *environment,
                                         LogMessage log, void *update) {
    Instance *m = add_instance(name);
    m->log = log;
    m->environment = environment;
    if (!is_started()) return NULL;
    return complete(m, CALL(InstantiateCoSimulation, text(name), text(token),
                            text(windows_path(resources)), V(visible), V(logging), V(events),
                            V(early), I(required, n), V(n), V(m->key), log_function(), V(0)));
}
EXPORT Handle F(InstantiateModelExchange)(String name, String token, String resources, bool visible,
                                          bool logging, void *environment, LogMessage log) {
    Instance *m = add_instance(name);
    m->log = log;
    m->environment = environment;
    if (!is_started()) return NULL;
    return complete(m, CALL(InstantiateModelExchange, text(name), text(token),
                            text(windows_path(resources)), V(visible), V(logging), V(m->key),
                            log_function()));
}
FUNCTION(EnterInitializationMode,
         (Handle c, bool has, double tolerance, double start, bool has_stop, double stop), V(c),
         V(has), D(tolerance), D(start), V(has_stop), D(stop))
FUNCTION(EnterConfigurationMode, (Handle c), V(c))
FUNCTION(ExitConfigurationMode, (Handle c), V(c))
FUNCTION(EnterStepMode, (Handle c), V(c))
FUNCTION(GetContinuousStateDerivatives, (Handle c, double x[], size_t n), V(c), O(x, n), V(n))
FUNCTION(GetNumberOfContinuousStates, (Handle c, size_t *n), V(c), O(n, 1))
FUNCTION(GetNumberOfEventIndicators, (Handle c, size_t *n), V(c), O(n, 1))
FUNCTION(UpdateDiscreteStates,
         (Handle c, bool *again, bool *ends, bool *nominals, bool *values, bool *has_next,
          double *next),
         V(c), O(again, 1), O(ends, 1), O(nominals, 1), O(values, 1), O(has_next, 1), O(next, 1))
FUNCTION(DoStep,
         (Handle c, double t, double h, bool f, bool *event, bool *ends, bool *early,
          double *reached),
         V(c), D(t), D(h), V(f), O(event, 1), O(ends, 1), O(early, 1), O(reached, 1))
FUNCTION(GetFMUState, (Handle c, void **state), V(c), block(DATA_INOUT, state, sizeof *state, 1))
FUNCTION(SetFMUState, (Handle c, void *state), V(c), V(state))
FUNCTION(FreeFMUState, (Handle c, void **state), V(c), block(DATA_INOUT, state, sizeof *state, 1))
FUNCTION(GetOutputDerivatives, (VARIABLES, const int order[], double v[], size_t nv), REFERENCES,
         I(order, n), O(v, nv), V(nv))
FUNCTION(GetDirectionalDerivative,
         (Handle c, const Reference u[], size_t nu, const Reference k[], size_t nk,
          const double s[], size_t ns, double r[], size_t nr),
         V(c), I(u, nu), V(nu), I(k, nk), V(nk), I(s, ns), V(ns), O(r, nr), V(nr))
#endif
