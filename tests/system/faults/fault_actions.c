/* Whatever can go wrong in a library that other people wrote. What and when stands in
   resources/fault.txt of the FMU: a line "fault FUNCTION WHEN WHAT", a line "record FILE", lines
   "attack NAME TARGET" for the fault "attack"; the string parameter `fault` says the same of one
   instance. */
#define _GNU_SOURCE
#include <arpa/inet.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <fenv.h>
#include <limits.h>
#include <locale.h>
#include <math.h>
#include <pthread.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <stdint.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>
#include <xmmintrin.h>
#include "fault_actions.h"

static Fault library;
static char record_file[PATH_MAX];
static struct { char name[40], target[PATH_MAX]; } attacks[100];
static size_t attack_count;

static void record(const char *format, ...) {
    if (!record_file[0]) return;
    char line[1024];
    va_list arguments;
    va_start(arguments, format);
    int n = vsnprintf(line, sizeof line - 1, format, arguments);
    va_end(arguments);
    n = n < (int)sizeof line - 1 ? n : (int)sizeof line - 2;
    line[n++] = '\n';
    int file = open(record_file, O_WRONLY | O_CREAT | O_APPEND, 0666);
    if (file >= 0 && write(file, line, n) != n) abort();
    if (file >= 0) close(file);
}

/* -- crashes -- */
static int segv(Lag *m) { return *(volatile int *volatile)NULL; }
static int bus(Lag *m) {
    FILE *empty = tmpfile();
    return *(volatile char *)mmap(NULL, 4096, PROT_READ, MAP_SHARED, fileno(empty), 0);
}
static int divide(Lag *m) { volatile int some = 7, zero = 0; return some / zero; }
static int illegal(Lag *m) { __builtin_trap(); }
static int deep(Lag *m) { volatile char frame[4096]; frame[0] = 1; return deep(m) + frame[0]; }
static int free_twice(Lag *m) { void *volatile p = malloc(64); free(p); free(p); return OK; }
static int abort_(Lag *m) { abort(); }
/* all memory that is shared with another process, when that has had time to look at it */
static int overwrite(Lag *m) {
    FILE *maps = fopen("/proc/self/maps", "r");
    char line[PATH_MAX + 100], rights[5];
    unsigned long begin, end;
    usleep(300000);
    while (maps && fgets(line, sizeof line, maps))
        if (sscanf(line, "%lx-%lx %4s", &begin, &end, rights) == 3 && rights[1] == 'w' &&
            rights[3] == 's')
            memset((void *)begin, 0x7f, end - begin);
    return OK;
}

/* -- ends and stands still -- */
static int exit_0(Lag *m) { exit(0); }
static int exit_3(Lag *m) { exit(3); }
static int exit_at_once(Lag *m) { _exit(0); }
static int kill_(Lag *m) { return raise(SIGKILL); }
static int loop(Lag *m) { for (volatile long n = 0;; n++) {} }
static int sleep_(Lag *m) { for (;;) pause(); }
static int read_stdin(Lag *m) {
    char byte;
    record("stdin %zd", read(0, &byte, 1));
    return OK;
}

/* -- quantities -- */
/* addresses only: nothing is touched, so that the machine does not suffer */
static int memory(Lag *m) {
    for (long mib = 0; mib < 65536; mib += 64)
        if (!malloc(64L << 20)) {
            say(ERROR, "error", "out of memory");
            record("memory %ld", mib);
            return ERROR;
        }
    return OK;
}
static int flood(int file) {
    char line[1000];
    memset(line, 'x', sizeof line);
    line[sizeof line - 1] = '\n';
    for (int n = 0; n < 100000; n++)
        if (write(file, line, sizeof line) < 0) break;
    return OK;
}
static int flood_stdout(Lag *m) { return flood(1); }
static int flood_stderr(Lag *m) { return flood(2); }
static int log_often(int count) {
    for (int n = 0; n < count; n++) say(OK, "info", "again");
    return OK;
}
static int flood_log(Lag *m) { return log_often(1000000); }
static int log_20000(Lag *m) { return log_often(20000); }
static int open_files(Lag *m) {
    int n = 0, spare = dup(0);
    while (n < 100000 && open("/dev/null", O_RDONLY) >= 0) n++;
    close(spare);
    record("files %d", n);
    return open("/dev/null", O_RDONLY) < 0;
}

/* -- log messages -- */
static int log_directives(Lag *m) { say(WARNING, "info", "%s%s%n%d%f 100%"); return OK; }
static int log_null(Lag *m) { say(WARNING, NULL, NULL); return OK; }
static int log_bytes(Lag *m) {
    say(WARNING, "\xff", "bad \xff\xfe\x80 bytes \x1b[31m red");
    return OK;
}
#define CONTROL "\x1b[31mred\x1b]0;title\a\xc2\x9b" "31m \xe2\x80\xae" "rtl\r"
static int log_control(Lag *m) { say(WARNING, "info", CONTROL "\nERROR other: faked"); return OK; }
static int print_control(Lag *m) {
    printf(CONTROL "\n");
    fflush(stdout);
    fprintf(stderr, CONTROL "\n");
    return OK;
}
static int log_long(Lag *m) {
    char *text = malloc(1 << 20);
    memset(text, 'y', 1 << 20);
    text[(1 << 20) - 1] = 0;
    say(WARNING, "info", text);
    free(text);
    return OK;
}
static void *chatter(void *m) {
    for (int n = 0; n < 100; n++) say(OK, "info", "from a thread");
    return NULL;
}
static int log_thread(Lag *m) {
    pthread_t thread;
    pthread_create(&thread, NULL, chatter, m);
    pthread_join(thread, NULL);
    return OK;
}

/* -- what belongs to the whole process -- */
static int round_up(Lag *m) { fesetround(FE_UPWARD); return OK; }
static int flush_to_zero(Lag *m) { _mm_setcsr(_mm_getcsr() | 0x8040); return OK; }
static int fp_traps(Lag *m) { feenableexcept(FE_DIVBYZERO | FE_INVALID | FE_OVERFLOW); return OK; }
static int change_folder(Lag *m) { return chdir("/"); }
static int change_locale(Lag *m) { return !setlocale(LC_ALL, "C.UTF-8"); }
static int give_up_files(Lag *m) { /* Landlock: all accesses to files are denied from now on */
    const uint64_t handled[2] = {0x1fff, 0};
    const long rules = syscall(444, handled, sizeof handled, 0);
    return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) || rules < 0 || syscall(446, rules, 0);
}
static int change_umask(Lag *m) { umask(0777); return OK; }
static int change_environment(Lag *m) { setenv("HOME", "/nowhere", 1); return unsetenv("PATH"); }
static int limit(int kind, long most) {
    struct rlimit found;
    return getrlimit(kind, &found) || setrlimit(kind, &(struct rlimit){most, found.rlim_max});
}
static int limit_files(Lag *m) { return limit(RLIMIT_NOFILE, 3); }
static int limit_size(Lag *m) { return limit(RLIMIT_FSIZE, 0); }
static int set_alarm(Lag *m) {
    return setitimer(ITIMER_REAL, &(struct itimerval){{0, 0}, {0, 200000}}, NULL);
}
static int block_signals(Lag *m) {
    sigset_t all;
    sigfillset(&all);
    return sigprocmask(SIG_BLOCK, &all, NULL);
}
static int ignore_interrupts(Lag *m) {
    signal(SIGINT, SIG_IGN);
    signal(SIGTERM, SIG_IGN);
    return OK;
}
static int close_output(Lag *m) { return close(1); }
static int truncate_all(Lag *m) {
    int result = 1;
    for (int file = 3; file < 256; file++) result &= ftruncate(file, 0);
    return OK;
}
static int close_all(Lag *m) { for (int file = 0; file < 256; file++) close(file); return OK; }

/* -- what stays behind -- */
static int linger(int own_session) {
    pid_t child = fork();
    if (child == 0) {
        if (own_session) setsid();
        sleep(120);
        _exit(0);
    }
    record("child %d", child);
    return OK;
}
static int fork_(Lag *m) { return linger(0); }
static int daemon_(Lag *m) { return linger(1); }
static int fork_return(Lag *m) { return fork() < 0; } /* the copy returns, too */
/* unknown to the C library */
static int fork_silently(Lag *m) { return syscall(SYS_clone, SIGCHLD, 0, 0, 0, 0) < 0; }
static int fork_program(Lag *m) {
    pid_t child = fork();
    int status = 1;
    if (child == 0) {
        execl("/bin/true", "true", (char *)NULL);
        _exit(1);
    }
    return waitpid(child, &status, 0) != child || status;
}
/* Write the bytes of the environment variable FAULT_ANSWER to all pipes, as a worker process
   answers its importer. */
static int answer(Lag *m) {
    const char *text = getenv("FAULT_ANSWER");
    struct stat status;
    for (int file = 3; text && file < 1024; file++)
        if (!fstat(file, &status) && S_ISFIFO(status.st_mode) &&
            write(file, text, strlen(text)) < 0)
            continue;
    return OK;
}
static void *for_ever(void *m) { for (;;) usleep(1000); }
static int thread(Lag *m) {
    Dl_info here;
    pthread_t id;
    dladdr((void *)thread, &here);
    /* its code stays, or it would crash at the unloading */
    dlopen(here.dli_fname, RTLD_NOW | RTLD_NODELETE);
    return pthread_create(&id, NULL, for_ever, m);
}
static int write_file(const char *path) {
    int file = open(path, O_WRONLY | O_CREAT, 0666);
    record("file %s %d", path, file >= 0);
    return file >= 0 ? write(file, "here\n", 5) != 5 : OK;
}
static int write_here(Lag *m) { return write_file("fault_was_here"); }
static int write_temporary(Lag *m) {
    char path[PATH_MAX];
    const char *folder = getenv("TMPDIR");
    snprintf(path, sizeof path, "%s/fault_was_here", folder ? folder : "/tmp");
    return write_file(path);
}
static int connect_(int kind) {
    struct sockaddr_in to = {AF_INET, htons(9), {htonl(INADDR_LOOPBACK)}};
    int s = socket(AF_INET, kind, 0);
    record("connect %d %m", connect(s, (struct sockaddr *)&to, sizeof to));
    return OK;
}
static int tcp(Lag *m) { return connect_(SOCK_STREAM); }
static int udp(Lag *m) { return connect_(SOCK_DGRAM); }
static int processes(Lag *m) { record("process %d child of %d", getpid(), getppid()); return OK; }

static int attack_all(Lag *m) {
    for (size_t i = 0; i < attack_count; i++) attack(attacks[i].name, attacks[i].target);
    return OK;
}

/* -- values and statuses -- */
static int put(Lag *m, double y) { if (m) m->x[Y] = y; return OK; }
static int nan_(Lag *m) { return put(m, NAN); }
static int infinity(Lag *m) { return put(m, INFINITY); }
static int ends(Lag *m, double part) { m->early = 1; m->part = part; return OK; }
static int early(Lag *m) { return ends(m, 0.5); }
static int stuck(Lag *m) { return ends(m, 0); }
static int back(Lag *m) { return ends(m, -3); }
static int beyond(Lag *m) { return ends(m, 2); }
static int nowhere(Lag *m) { return ends(m, NAN); }
static int spoil(Lag *m) { m->spoiled = 1; return OK; }
static int speechless(Lag *m) { m->speechless = 1; return OK; }
static int babble(Lag *m) { strcpy(m->text, "\xff\xfe"); return OK; }
static int vast(Lag *m) { m->vast = 1; return OK; }
static int event(Lag *m) { m->event = 1; return OK; }
static int terminate(Lag *m) { m->terminate = 1; return OK; }
#define STATUS(NAME, VALUE) \
    static int NAME(Lag *m) { \
        say(VALUE, "status", "told to return " #NAME); \
        return VALUE; \
    }
STATUS(warning, WARNING) STATUS(discard, DISCARD) STATUS(error, ERROR) STATUS(fatal, FATAL)
STATUS(pending, PENDING) STATUS(undefined, 17) STATUS(hundred, 100) STATUS(negative, -1)

static const struct { const char *name; int (*act)(Lag *);
} FAULTS[] = {
    {"warning", warning},
    {"discard", discard},
    {"error", error},
    {"fatal", fatal},
    {"pending", pending},
    {"undefined", undefined},
    {"hundred", hundred},
    {"negative", negative},
    {"nan", nan_},
    {"infinity", infinity},
    {"early", early},
    {"event", event},
    {"stuck", stuck},
    {"back", back},
    {"beyond", beyond},
    {"nowhere", nowhere},
    {"spoil", spoil},
    {"terminate", terminate},
    {"speechless", speechless},
    {"babble", babble},
    {"vast", vast},
    {"segv", segv},
    {"bus", bus},
    {"divide", divide},
    {"illegal", illegal},
    {"deep", deep},
    {"abort", abort_},
    {"overwrite", overwrite},
    {"free_twice", free_twice},
    {"exit_0", exit_0},
    {"exit_3", exit_3},
    {"exit_at_once", exit_at_once},
    {"kill", kill_},
    {"loop", loop},
    {"sleep", sleep_},
    {"read_stdin", read_stdin},
    {"memory", memory},
    {"flood_stdout", flood_stdout},
    {"flood_stderr", flood_stderr},
    {"flood_log", flood_log},
    {"open_files", open_files},
    {"log_directives", log_directives},
    {"log_null", log_null},
    {"log_bytes", log_bytes},
    {"log_long", log_long},
    {"log_control", log_control},
    {"print_control", print_control},
    {"log_thread", log_thread},
    {"log_20000", log_20000},
    {"round_up", round_up},
    {"flush_to_zero", flush_to_zero},
    {"fp_traps", fp_traps},
    {"give_up_files", give_up_files},
    {"change_folder", change_folder},
    {"change_locale", change_locale},
    {"change_umask", change_umask},
    {"limit_files", limit_files},
    {"limit_size", limit_size},
    {"set_alarm", set_alarm},
    {"block_signals", block_signals},
    {"change_environment", change_environment},
    {"ignore_interrupts", ignore_interrupts},
    {"close_output", close_output},
    {"truncate_all", truncate_all},
    {"close_all", close_all},
    {"fork", fork_},
    {"daemon", daemon_},
    {"answer", answer},
    {"fork_return", fork_return},
    {"fork_silently", fork_silently},
    {"fork_program", fork_program},
    {"thread", thread},
    {"write_here", write_here},
    {"attack", attack_all},
    {"write_temporary", write_temporary},
    {"tcp", tcp},
    {"udp", udp},
    {"processes", processes},
};

static int misbehave(Fault *fault, Lag *m, const char *function, double time) {
    int any = !strcmp(fault->where, "*") && strcmp(function, "load") && strcmp(function, "unload");
    if (!fault->what[0] || (!any && strcmp(fault->where, function))) return OK;
    fault->count++;
    int timed = fault->when[0] == '@', each = fault->when[0] == '*';
    if (timed ? fault->done || time < atof(fault->when + 1) - 1e-9
              : !each && fault->count != atol(fault->when))
        return OK;
    fault->done = 1;
    for (size_t i = 0; i < sizeof FAULTS / sizeof *FAULTS; i++)
        if (!strcmp(FAULTS[i].name, fault->what)) return FAULTS[i].act(m);
    fprintf(stderr, "the fault FMU knows no fault \"%s\"\n", fault->what);
    abort();
}

int enter(Lag *m, const char *function, const char *format, ...) {
    char text[800];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    record("%s %s%s %s", m ? m->name : "-", PREFIX, function, text);
    double time = m ? m->time : -1e300;
    int status = misbehave(&library, m, function, time);
    if (!status && m) status = misbehave(&m->fault, m, function, time);
    if (status) record("%s status %d", m ? m->name : "-", status);
    return status;
}

void record_values(char *line, size_t room, const unsigned *references, size_t count,
                   const double *values) {
    line[0] = 0;
    for (size_t k = 0, used = 0; k < count && used < room; k++)
        used += snprintf(line + used, room - used, "%s%u=%.17g", k ? " " : "", references[k],
                         values[k]);
}

Lag *new_lag(const char *name) {
    Lag *m = calloc(1, sizeof(Lag));
    m->x[Y] = m->x[Y_START] = 1;
    m->x[T] = 0.5;
    snprintf(m->name, sizeof m->name, "%s", name);
    return m;
}
void tell(Lag *m, const char *text) {
    snprintf(m->text, sizeof m->text, "%s", text);
    memset(&m->fault, 0, sizeof m->fault);
    sscanf(text, "%39s %23s %23s", m->fault.where, m->fault.when, m->fault.what);
}
void lag_start(Lag *m) { m->x[Y] = m->x[Y_START]; }
void lag_step(Lag *m, double t, double h) {
    m->time = m->reached = t + h;
    m->x[Y] += h * (m->x[U] - m->x[Y]) / m->x[T];
}

static void read_orders(const char *path) {
    FILE *file = fopen(path, "r");
    char line[PATH_MAX + 16];
    while (file && fgets(line, sizeof line, file)) {
        sscanf(line, "fault %39s %23s %23s", library.where, library.when, library.what);
        sscanf(line, "record %4095[^\n]", record_file);
        if (attack_count < 100 && sscanf(line, "attack %39s %4095[^\n]", attacks[attack_count].name,
                                         attacks[attack_count].target) == 2)
            attack_count++;
    }
    if (file) fclose(file);
}
static __attribute__((constructor)) void loaded(void) {
    Dl_info here;
    char path[PATH_MAX];
    dladdr((void *)loaded, &here);
    snprintf(path, sizeof path, "%s", here.dli_fname);
    for (int up = 0; up < 3; up++) *strrchr(path, '/') = 0; /* binaries/PLATFORM/fault.so */
    strncat(path, "/resources/fault.txt", sizeof path - strlen(path) - 1);
    read_orders(path);
    misbehave(&library, NULL, "load", 0);
}
static __attribute__((destructor)) void unloaded(void) { misbehave(&library, NULL, "unload", 0); }
