/*
 * A stand-in for National Instruments' libNiFpga.so: the functions that the Python package nifpga calls to run a myRIO.
 *
 * Registers live in a file that is mapped into every process that opens the resource, so that two sessions, also of two
 * processes, see one FPGA; the layout below is written down once more in shared.py. The file of resource "RIO0" is
 * $PAMRIG_RIO_DIR/RIO0, that of "rio://host/RIO0" is $PAMRIG_RIO_DIR/rio___host_RIO0. Analog outputs are staged until AO.SYS.GO is
 * written, as on the myRIO. The plant is not here: a hook, set from Python, is called before an input is read and after the
 * outputs have changed.
 */
#include <fcntl.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#define SLOTS 8192
#define BASE 0x18000u
#define MAX_SESSIONS 256
#define MAX_OUTPUTS 32

/* Status codes: nifpga/status.py */
enum { OK = 0, ALREADY_RUNNING = 61003, INVALID_PARAMETER = -52005, RPC_CONNECTION = -63040, BITFILE_READ = -63101,
       SIGNATURE_MISMATCH = -63106, INVALID_RESOURCE = -63192, INVALID_SESSION = -63195, OUT_OF_HANDLES = -63198 };
/* Groups of functions, for fault_mask */
enum { OPEN = 1, CLOSE = 2, CONTROL = 4, READ = 8, WRITE = 16 };
/* Properties of a register */
enum { EXISTS = 1, INDICATOR = 2, HOOK_READ = 4, HOOK_WRITE = 8, STROBE = 16 };
/* What the hook is told */
enum { BEFORE_READ = 0, AFTER_WRITE = 1, AFTER_STROBE = 2, DELAY_US = 3 };

struct fpga {
    char magic[8];
    char signature[40];
    uint32_t vi_state;     /* 0 not running, 1 invalid, 2 running, 3 stopped by itself */
    uint32_t boot;         /* raised by a power cycle: sessions of an older boot are invalid */
    uint32_t sessions;
    uint32_t latency_us;   /* every call takes at least this, as over the network */
    int32_t fault_status;  /* injected: what the failing calls return */
    uint32_t fault_mask;   /* which groups of functions fail */
    int32_t fault_after;   /* this many of them still succeed */
    uint32_t fault_count;  /* then this many fail; all ones: for good */
    uint32_t stall_us;     /* the failing calls take this long; with status 0 they only stall */
    uint32_t outputs;      /* how many of output_slot are used */
    uint64_t calls;
    uint64_t strobes;
    uint32_t output_slot[MAX_OUTPUTS];
    uint8_t padding[4096 - 104 - 4 * MAX_OUTPUTS];
    uint64_t value[SLOTS]; /* as the host wrote it, or as the FPGA measured it */
    uint64_t pin[SLOTS];   /* what the output terminals carry */
    uint8_t kind[SLOTS];   /* of the properties above */
};

typedef void (*hook_t)(const char *resource, int event, uint32_t argument);

static struct { struct fpga *fpga; uint32_t boot; char key[128]; } sessions[MAX_SESSIONS];
static hook_t hook;

void pamrig_set_hook(hook_t function) { hook = function; }

static void wait_us(const char *key, uint32_t us)
{
    if (us && hook)
        hook(key, DELAY_US, us);
    else if (us) {
        struct timespec left = {us / 1000000, (long)(us % 1000000) * 1000};
        nanosleep(&left, NULL);
    }
}

/* Every call passes here: count it, delay it, and fail it when a fault is armed for its group. */
static int32_t enter(struct fpga *fpga, const char *key, uint32_t group)
{
    fpga->calls++;
    wait_us(key, fpga->latency_us);
    if (!(fpga->fault_mask & group) || !fpga->fault_count)
        return OK;
    if (fpga->fault_after > 0) {
        fpga->fault_after--;
        return OK;
    }
    if (fpga->fault_count != UINT32_MAX)
        fpga->fault_count--;
    wait_us(key, fpga->stall_us);
    return fpga->fault_status;
}

static int32_t session_of(uint32_t session, uint32_t group, struct fpga **fpga)
{
    if (session == 0 || session > MAX_SESSIONS || !sessions[session - 1].fpga)
        return INVALID_SESSION;
    *fpga = sessions[session - 1].fpga;
    int32_t status = enter(*fpga, sessions[session - 1].key, group);
    if (status == OK && sessions[session - 1].boot != (*fpga)->boot)
        status = INVALID_SESSION;
    return status;
}

static struct fpga *map(const char *key)
{
    char path[512];
    const char *folder = getenv("PAMRIG_RIO_DIR");
    if (snprintf(path, sizeof path, "%s/%s", folder ? folder : ".", key) >= (int)sizeof path)
        return NULL;
    int file = open(path, O_RDWR);
    struct stat facts;
    if (file < 0)
        return NULL;
    struct fpga *fpga = MAP_FAILED;
    if (fstat(file, &facts) == 0 && facts.st_size >= (off_t)sizeof *fpga)
        fpga = mmap(NULL, sizeof *fpga, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    close(file);
    if (fpga == MAP_FAILED)
        return NULL;
    if (memcmp(fpga->magic, "PAMRIO1", 8) != 0) {
        munmap(fpga, sizeof *fpga);
        return NULL;
    }
    return fpga;
}

/* The library reads the bitfile itself, by its path, and wants to find in it the signature that it is told. */
static int32_t check(const char *bitfile, const char *signature)
{
    FILE *file = fopen(bitfile, "r");
    if (!file)
        return BITFILE_READ;
    char line[4096];
    int32_t status = SIGNATURE_MISMATCH;
    while (status != OK && fgets(line, sizeof line, file))
        if (strstr(line, signature))
            status = OK;
    fclose(file);
    return status;
}

int32_t NiFpgaDll_Open(const char *bitfile, const char *signature, const char *resource, uint32_t attribute, uint32_t *session)
{
    uint32_t free_slot = 0;
    int32_t status = check(bitfile, signature);
    if (status != OK)
        return status;
    while (free_slot < MAX_SESSIONS && sessions[free_slot].fpga)
        free_slot++;
    if (free_slot == MAX_SESSIONS)
        return OUT_OF_HANDLES;
    char *key = sessions[free_slot].key;
    snprintf(key, sizeof sessions[0].key, "%s", resource);
    for (char *c = key; *c; c++)
        if (*c == '/' || *c == ':')
            *c = '_';
    struct fpga *fpga = map(key);
    if (!fpga)
        return strncmp(resource, "rio://", 6) == 0 ? RPC_CONNECTION : INVALID_RESOURCE;
    status = enter(fpga, key, OPEN);
    if (status == OK && strncmp(fpga->signature, signature, sizeof fpga->signature) != 0)
        status = SIGNATURE_MISMATCH;
    if (status < OK) {
        munmap(fpga, sizeof *fpga);
        return status;
    }
    fpga->sessions++;
    sessions[free_slot].fpga = fpga;
    sessions[free_slot].boot = fpga->boot;
    *session = free_slot + 1;
    if (!(attribute & 1))
        fpga->vi_state = 2;
    return status;
}

int32_t NiFpgaDll_Close(uint32_t session, uint32_t attribute)
{
    struct fpga *fpga;
    int32_t status = session_of(session, CLOSE, &fpga);
    if (status == INVALID_SESSION && (session == 0 || session > MAX_SESSIONS || !sessions[session - 1].fpga))
        return status;
    if (fpga->sessions && --fpga->sessions == 0 && !(attribute & 1) && status == OK) {
        fpga->vi_state = 0; /* resets the VI with its last session */
        memset(fpga->pin, 0, sizeof fpga->pin);
    }
    munmap(fpga, sizeof *fpga);
    sessions[session - 1].fpga = NULL;
    return status;
}

int32_t NiFpgaDll_Run(uint32_t session, uint32_t attribute)
{
    struct fpga *fpga;
    int32_t status = session_of(session, CONTROL, &fpga);
    (void)attribute;
    if (status != OK)
        return status;
    if (fpga->vi_state == 2)
        return ALREADY_RUNNING;
    fpga->vi_state = 2;
    return OK;
}

static int32_t stop(uint32_t session)
{
    struct fpga *fpga;
    int32_t status = session_of(session, CONTROL, &fpga);
    if (status == OK) {
        fpga->vi_state = 0;
        memset(fpga->pin, 0, sizeof fpga->pin);
    }
    return status;
}

int32_t NiFpgaDll_Abort(uint32_t session) { return stop(session); }
int32_t NiFpgaDll_Reset(uint32_t session) { return stop(session); }
int32_t NiFpgaDll_Download(uint32_t session) { return stop(session); }

int32_t NiFpgaDll_GetFpgaViState(uint32_t session, uint32_t *state)
{
    struct fpga *fpga;
    int32_t status = session_of(session, CONTROL, &fpga);
    if (status == OK)
        *state = fpga->vi_state;
    return status;
}

static int32_t slot_of(struct fpga *fpga, uint32_t address, uint32_t *slot)
{
    *slot = ((address & 0x7fffffffu) - BASE) / 2;
    return *slot < SLOTS && (fpga->kind[*slot] & EXISTS) ? OK : INVALID_PARAMETER;
}

static int32_t get(uint32_t session, uint32_t address, void *value, size_t size)
{
    struct fpga *fpga;
    uint32_t slot;
    int32_t status = session_of(session, READ, &fpga);
    if (status < OK || slot_of(fpga, address, &slot) != OK)
        return status < OK ? status : INVALID_PARAMETER;
    if (hook && (fpga->kind[slot] & HOOK_READ))
        hook(sessions[session - 1].key, BEFORE_READ, slot);
    memcpy(value, &fpga->value[slot], size); /* little endian */
    return status;
}

static int32_t put(uint32_t session, uint32_t address, uint64_t value)
{
    struct fpga *fpga;
    uint32_t slot;
    int32_t status = session_of(session, WRITE, &fpga);
    if (status < OK || slot_of(fpga, address, &slot) != OK)
        return status < OK ? status : INVALID_PARAMETER;
    if (fpga->kind[slot] & INDICATOR)
        return status; /* the FPGA writes it; what a host writes is lost */
    fpga->value[slot] = value;
    if (fpga->kind[slot] & STROBE) {
        for (uint32_t i = 0; i < fpga->outputs && i < MAX_OUTPUTS && fpga->vi_state == 2; i++)
            fpga->pin[fpga->output_slot[i] % SLOTS] = fpga->value[fpga->output_slot[i] % SLOTS];
        fpga->strobes++;
        if (hook)
            hook(sessions[session - 1].key, AFTER_STROBE, slot);
    } else if (hook && (fpga->kind[slot] & HOOK_WRITE))
        hook(sessions[session - 1].key, AFTER_WRITE, slot);
    return status;
}

#define SCALAR(name, type)                                                                                                    \
    int32_t NiFpgaDll_Read##name(uint32_t session, uint32_t address, type *value)                                              \
    {                                                                                                                         \
        return get(session, address, value, sizeof *value);                                                                   \
    }                                                                                                                         \
    int32_t NiFpgaDll_Write##name(uint32_t session, uint32_t address, type value)                                              \
    {                                                                                                                         \
        uint64_t wide = 0;                                                                                                    \
        memcpy(&wide, &value, sizeof value);                                                                                  \
        return put(session, address, wide);                                                                                   \
    }

SCALAR(Bool, uint8_t)
SCALAR(I8, int8_t)
SCALAR(U8, uint8_t)
SCALAR(I16, int16_t)
SCALAR(U16, uint16_t)
SCALAR(I32, int32_t)
SCALAR(U32, uint32_t)
SCALAR(I64, int64_t)
SCALAR(U64, uint64_t)
SCALAR(Sgl, float)
SCALAR(Dbl, double)
