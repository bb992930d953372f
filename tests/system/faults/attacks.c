/* Attacks of an FMU on files, processes and resources outside. Each line "attack NAME TARGET" in
   resources/fault.txt of the FMU is one; its outcome is a line "attack NAME: reached" or "attack
   NAME: ERROR" on standard error. What an attack creates for the whole system, it removes. */
#define _GNU_SOURCE
#include <arpa/inet.h>
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/keyctl.h>
#include <linux/netlink.h>
#include <mqueue.h>
#include <sched.h>
#include <signal.h>
#include <spawn.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/auxv.h>
#include <sys/inotify.h>
#include <sys/ipc.h>
#include <sys/klog.h>
#include <sys/mman.h>
#include <sys/msg.h>
#include <sys/personality.h>
#include <sys/prctl.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/sem.h>
#include <sys/shm.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <sys/uio.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <sys/xattr.h>
#include <unistd.h>
#include "fault_actions.h"

/* An attack returns the error number, 0 if it reached its target. */
#define ATTACK(NAME) static int NAME(const char *target)
#define CALL(EXPRESSION) ((EXPRESSION) < 0 ? errno : 0)
#define PID ((pid_t)atoi(target))

/* -- files -- */
static int use(int file) { return file < 0 ? errno : close(file); }
static const char *with_suffix(const char *path, const char *suffix) {
    static char text[4200];
    snprintf(text, sizeof text, "%s%s", path, suffix);
    return text;
}
ATTACK(read_file) {
    char text[32] = "";
    int file = open(target, O_RDONLY);
    if (file < 0 || read(file, text, sizeof text - 1) < 0) return errno;
    return strcmp(text, "secret") ? EIO : use(file);
}
ATTACK(read_users) { return use(open("/etc/passwd", O_RDONLY)); }
ATTACK(list_folder) {
    DIR *folder = opendir(target);
    return folder && readdir(folder) ? closedir(folder) : errno;
}
ATTACK(list_processes) { return list_folder("/proc"); }
ATTACK(create_file) { return use(open(with_suffix(target, ".new"), O_WRONLY | O_CREAT, 0666)); }
ATTACK(append_to_file) {
    int file = open(target, O_WRONLY | O_APPEND);
    return file < 0 ? errno : CALL(write(file, "more", 4));
}
ATTACK(truncate_file) { return CALL(truncate(target, 0)); }
ATTACK(truncate_by_reading) { return use(open(target, O_RDONLY | O_TRUNC)); }
ATTACK(delete_file) { return CALL(unlink(target)); }
ATTACK(rename_file) { return CALL(rename(target, with_suffix(target, ".new"))); }
ATTACK(link_file) { return CALL(link(target, with_suffix(target, ".new"))); }
ATTACK(create_symlink) { return CALL(symlink("/etc/passwd", with_suffix(target, ".new"))); }
ATTACK(create_folder) { return CALL(mkdir(with_suffix(target, ".new"), 0777)); }
ATTACK(create_fifo) { return CALL(mkfifo(with_suffix(target, ".new"), 0666)); }
ATTACK(create_socket_file) {
    struct sockaddr_un at = {AF_UNIX};
    snprintf(at.sun_path, sizeof at.sun_path, "%s.new", target);
    int s = socket(AF_UNIX, SOCK_STREAM, 0);
    return s < 0 ? errno : CALL(bind(s, (void *)&at, sizeof at));
}
ATTACK(change_mode) { return CALL(chmod(target, 0777)); }
ATTACK(change_mode_at) { return CALL(fchmodat(AT_FDCWD, target, 0777, 0)); }
ATTACK(change_owner) { return CALL(chown(target, getuid(), getgid())); }
ATTACK(change_times) { return CALL(utimes(target, (struct timeval[2]){{1, 0}, {1, 0}})); }
ATTACK(change_times_at) {
    return CALL(utimensat(AT_FDCWD, target, (struct timespec[2]){{1, 0}, {1, 0}}, 0));
}
ATTACK(set_attribute) { return CALL(setxattr(target, "user.attack", "x", 1, 0)); }
ATTACK(read_attribute) {
    char value[8] = "";
    return getxattr(target, "user.attack", value, sizeof value) < 0 ? errno
           : strcmp(value, "secret")                                ? EIO
                                                                    : 0;
}
ATTACK(watch_folder) {
    int watch = inotify_init();
    return watch < 0 ? errno : CALL(inotify_add_watch(watch, target, IN_ALL_EVENTS));
}
ATTACK(create_device) { /* in the folder for temporary files; the device is /dev/null */
    const char *folder = getenv("TMPDIR");
    return CALL(
        mknod(with_suffix(folder ? folder : "/tmp", "/device"), S_IFCHR | 0666, 1 << 8 | 3));
}
ATTACK(open_by_handle) {
    struct { struct file_handle head; unsigned char bytes[128]; } handle = {{128}};
    int mount, folder = open("/", O_PATH);
    if (name_to_handle_at(AT_FDCWD, target, &handle.head, &mount, 0)) return errno;
    return folder < 0 ? errno : close(folder);
}

/* -- environment -- */
ATTACK(environment) { return getenv("PATH") ? 0 : ENOENT; }
ATTACK(environment_file) {
    char text[65536];
    int file = open("/proc/self/environ", O_RDONLY);
    ssize_t size = file < 0 ? -1 : read(file, text, sizeof text);
    return size < 0 ? errno : memmem(text, size, "PATH=", 5) ? close(file) : ENOENT;
}
ATTACK(environment_memory) { /* the variables lie below the name of the program */
    char *end = (char *)getauxval(AT_EXECFN);
    return memmem(end - 16384, 16384, "PATH=", 5) ? 0 : ENOENT;
}

/* -- processes -- */
ATTACK(fork_process) {
    pid_t child = fork();
    if (child == 0) _exit(0);
    return child < 0 ? errno : CALL(waitpid(child, NULL, 0));
}
ATTACK(fork_by_clone) {
    long child = syscall(SYS_clone, SIGCHLD, 0, 0, 0, 0);
    if (child == 0) _exit(0);
    return child < 0 ? errno : CALL(waitpid(child, NULL, 0));
}
ATTACK(run_program) {
    pid_t child;
    char *words[] = {"true", NULL};
    int error = posix_spawnp(&child, "true", NULL, NULL, words, environ);
    return error ? error : CALL(waitpid(child, NULL, 0));
}
ATTACK(leave_process) {
    pid_t child = fork();
    if (child == 0) {
        setsid();
        sleep(60);
        _exit(0);
    }
    return CALL(child);
}
ATTACK(kill_process) { return CALL(kill(PID, SIGKILL)); }
ATTACK(kill_importer) { return CALL(kill(getppid(), SIGKILL)); }
ATTACK(signal_thread) { return CALL(syscall(SYS_tgkill, PID, PID, SIGWINCH)); }
ATTACK(queue_signal) { return CALL(sigqueue(PID, SIGWINCH, (union sigval){0})); }
ATTACK(signal_by_descriptor) {
    int process = syscall(SYS_pidfd_open, PID, 0);
    return process < 0 ? errno : CALL(syscall(SYS_pidfd_send_signal, process, SIGWINCH, NULL, 0));
}
ATTACK(signal_by_pipe) {
    int ends[2];
    return pipe(ends) ? errno : CALL(fcntl(ends[0], F_SETOWN, PID));
}
ATTACK(trace_process) {
    long error = CALL(ptrace(PTRACE_SEIZE, PID, NULL, NULL));
    if (!error) ptrace(PTRACE_DETACH, PID, NULL, NULL);
    return error;
}
ATTACK(read_memory) { /* at an address that is not mapped: EFAULT means permitted */
    char byte;
    struct iovec here = {&byte, 1}, there = {(void *)16, 1};
    return process_vm_readv(PID, &here, 1, &there, 1, 0) < 0 && errno != EFAULT ? errno : 0;
}
static int open_of_process(const char *target, const char *name, int flags) {
    char path[64];
    snprintf(path, sizeof path, "/proc/%s/%s", target, name);
    return open(path, flags);
}
ATTACK(read_environment_of_process) { return use(open_of_process(target, "environ", O_RDONLY)); }
ATTACK(change_limits) { return CALL(prlimit(PID, RLIMIT_NOFILE, &(struct rlimit){64, 64}, NULL)); }
ATTACK(change_priority) { return CALL(setpriority(PRIO_PROCESS, PID, 7)); }
ATTACK(change_scheduler) {
    return CALL(sched_setscheduler(PID, SCHED_BATCH, &(struct sched_param){0}));
}
ATTACK(change_processors) {
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(0, &one);
    return CALL(sched_setaffinity(PID, sizeof one, &one));
}
ATTACK(change_io_priority) { return CALL(syscall(SYS_ioprio_set, 1, PID, 3 << 13 | 0)); }
ATTACK(offer_to_memory_killer) {
    int file = open_of_process(target, "oom_score_adj", O_WRONLY);
    return file < 0 ? errno : CALL(write(file, "900", 3));
}
ATTACK(outlive_importer) { return CALL(prctl(PR_SET_PDEATHSIG, 0)); }
ATTACK(raise_limits) {
    return CALL(setrlimit(RLIMIT_CORE, &(struct rlimit){RLIM_INFINITY, RLIM_INFINITY}));
}

/* -- network and sockets -- */
static int send_to(int family, int kind, const void *address, socklen_t size) {
    int s = socket(family, kind | SOCK_NONBLOCK, 0);
    if (s < 0) return errno;
    if (connect(s, address, size) && errno != EINPROGRESS) return errno;
    return CALL(kind == SOCK_DGRAM ? send(s, "attack", 6, 0) : 0);
}
static int send_to_port(int kind, const char *port) {
    struct sockaddr_in to = {AF_INET, htons(atoi(port)), {htonl(INADDR_LOOPBACK)}};
    return send_to(AF_INET, kind, &to, sizeof to);
}
ATTACK(tcp) { return send_to_port(SOCK_STREAM, target); }
ATTACK(udp) { return send_to_port(SOCK_DGRAM, target); }
ATTACK(tcp6) {
    int s = socket(AF_INET6, SOCK_STREAM, 0);
    return s < 0 ? errno : close(s);
}
static int serve(int bound) {
    struct sockaddr_in at = {AF_INET, 0, {htonl(INADDR_LOOPBACK)}};
    int s = socket(AF_INET, SOCK_STREAM, 0);
    if (s < 0 || (bound && bind(s, (void *)&at, sizeof at)) || listen(s, 1)) return errno;
    return close(s);
}
ATTACK(server) { return serve(1); }
ATTACK(server_without_bind) { return serve(0); }
static int send_to_name(int kind, const char *name, int abstract) {
    struct sockaddr_un to = {AF_UNIX};
    snprintf(to.sun_path + abstract, sizeof to.sun_path - abstract, "%s", name);
    return send_to(AF_UNIX, kind, &to,
                   offsetof(struct sockaddr_un, sun_path) + abstract + strlen(name));
}
ATTACK(local_stream) { return send_to_name(SOCK_STREAM, target, 0); }
ATTACK(local_datagram) { return send_to_name(SOCK_DGRAM, target, 0); }
ATTACK(abstract_socket) { return send_to_name(SOCK_DGRAM, target, 1); }
ATTACK(socket_pair) {
    int ends[2];
    return CALL(socketpair(AF_UNIX, SOCK_DGRAM, 0, ends));
}
ATTACK(list_interfaces) {
    int s = socket(AF_NETLINK, SOCK_RAW, NETLINK_ROUTE);
    return s < 0 ? errno : close(s);
}

/* -- objects of the system -- */
ATTACK(shared_memory) {
    int id = shmget(IPC_PRIVATE, 4096, 0600);
    return id < 0 ? errno : CALL(shmctl(id, IPC_RMID, NULL));
}
ATTACK(message_queue) {
    int id = msgget(IPC_PRIVATE, 0600);
    return id < 0 ? errno : CALL(msgctl(id, IPC_RMID, NULL));
}
ATTACK(semaphores) {
    int id = semget(IPC_PRIVATE, 1, 0600);
    return id < 0 ? errno : CALL(semctl(id, 0, IPC_RMID));
}
ATTACK(posix_queue) {
    mqd_t queue = mq_open(target, O_CREAT | O_RDWR, 0600, NULL);
    return queue < 0 ? errno : CALL(mq_unlink(target));
}
ATTACK(posix_memory) {
    int file = shm_open(target, O_CREAT | O_RDWR, 0600);
    return file < 0 ? errno : CALL(shm_unlink(target));
}
ATTACK(add_key) {
    long key =
        syscall(SYS_add_key, "user", "cosim-attack", "x", (size_t)1, KEY_SPEC_PROCESS_KEYRING);
    return key < 0 ? errno : CALL(syscall(SYS_keyctl, KEYCTL_REVOKE, key));
}
ATTACK(find_keyring) {
    return CALL(syscall(SYS_keyctl, KEYCTL_GET_KEYRING_ID, KEY_SPEC_USER_KEYRING, 1));
}
ATTACK(memory_file) { return use(memfd_create("attack", 0)); }

/* -- the kernel -- */
/* in a child, where there can be one: the process stays in the namespace */
ATTACK(user_namespace) {
    pid_t child = fork();
    int status = 0;
    if (child == 0) _exit(unshare(CLONE_NEWUSER) ? errno : 0);
    return child < 0                        ? CALL(unshare(CLONE_NEWUSER))
           : waitpid(child, &status, 0) < 0 ? errno
                                            : WEXITSTATUS(status);
}
ATTACK(io_ring) {
    char parameters[256] = "";
    return use(syscall(SYS_io_uring_setup, 1, parameters));
}
ATTACK(kernel_log) { return CALL(klogctl(10, NULL, 0)); }
ATTACK(fixed_addresses) { return CALL(personality(ADDR_NO_RANDOMIZE)); }
#define ENTRY(NAME) {#NAME, NAME}
static const struct { const char *name; int (*act)(const char *);
} ATTACKS[] = {
    ENTRY(read_file),
    ENTRY(read_users),
    ENTRY(list_folder),
    ENTRY(list_processes),
    ENTRY(create_file),
    ENTRY(append_to_file),
    ENTRY(truncate_file),
    ENTRY(truncate_by_reading),
    ENTRY(delete_file),
    ENTRY(rename_file),
    ENTRY(link_file),
    ENTRY(create_symlink),
    ENTRY(create_folder),
    ENTRY(create_fifo),
    ENTRY(create_socket_file),
    ENTRY(change_mode),
    ENTRY(change_mode_at),
    ENTRY(change_owner),
    ENTRY(change_times),
    ENTRY(change_times_at),
    ENTRY(set_attribute),
    ENTRY(read_attribute),
    ENTRY(watch_folder),
    ENTRY(create_device),
    ENTRY(open_by_handle),
    ENTRY(environment),
    ENTRY(environment_file),
    ENTRY(environment_memory),
    ENTRY(fork_process),
    ENTRY(fork_by_clone),
    ENTRY(run_program),
    ENTRY(leave_process),
    ENTRY(kill_process),
    ENTRY(kill_importer),
    ENTRY(signal_thread),
    ENTRY(queue_signal),
    ENTRY(signal_by_descriptor),
    ENTRY(signal_by_pipe),
    ENTRY(trace_process),
    ENTRY(read_memory),
    ENTRY(read_environment_of_process),
    ENTRY(change_limits),
    ENTRY(change_priority),
    ENTRY(change_scheduler),
    ENTRY(change_processors),
    ENTRY(change_io_priority),
    ENTRY(offer_to_memory_killer),
    ENTRY(outlive_importer),
    ENTRY(raise_limits),
    ENTRY(tcp),
    ENTRY(udp),
    ENTRY(tcp6),
    ENTRY(server),
    ENTRY(server_without_bind),
    ENTRY(local_stream),
    ENTRY(local_datagram),
    ENTRY(abstract_socket),
    ENTRY(socket_pair),
    ENTRY(list_interfaces),
    ENTRY(shared_memory),
    ENTRY(message_queue),
    ENTRY(semaphores),
    ENTRY(posix_queue),
    ENTRY(posix_memory),
    ENTRY(add_key),
    ENTRY(find_keyring),
    ENTRY(memory_file),
    ENTRY(user_namespace),
    ENTRY(io_ring),
    ENTRY(kernel_log),
    ENTRY(fixed_addresses),
};

void attack(const char *name, const char *target) {
    for (size_t i = 0; i < sizeof ATTACKS / sizeof *ATTACKS; i++)
        if (!strcmp(ATTACKS[i].name, name)) {
            int error = ATTACKS[i].act(target);
            fprintf(stderr, "attack %s: %s\n", name, error ? strerror(error) : "reached");
        }
}
