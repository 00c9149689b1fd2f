# Writes stars.png, a night sky: equirectangular, brightness of stars by a power law, more of them along a band.
import random, struct, zlib, math
W,H=2048,1024
random.seed(7)
px=[]
for y in range(H):
    up=max(0,math.cos(math.pi*(y+0.5)/H)); f=(1-up)**2.2
    px+=[[int(9+34*f),int(13+38*f),int(36+52*f)] for _ in range(W)]
def put(x,y,c):
    if 0<=y<H:
        p=px[y*W+x%W]
        for k in range(3): p[k]=min(255,p[k]+int(c[k]))
axis=(0.35,0.75,0.56)
n=math.sqrt(sum(a*a for a in axis)); axis=[a/n for a in axis]
count=0
while count<5200:
    z=random.uniform(-1,1); a=random.uniform(0,2*math.pi); s=math.sqrt(1-z*z)
    d=(s*math.cos(a),z,s*math.sin(a))
    off=abs(sum(d[i]*axis[i] for i in range(3)))
    if random.random()>0.35+0.65*math.exp(-(off/0.16)**2): continue
    count+=1
    b=18*random.random()**(-0.8)
    b=min(b,900)
    t=random.random()
    col=(1,0.72+0.28*t,0.45+0.55*t) if t<0.5 else (1-0.35*(t-0.5)*2,1-0.2*(t-0.5)*2,1)
    x=int((math.atan2(d[2],d[0])/(2*math.pi)+0.5)*W); y=int(math.acos(d[1])/math.pi*H)
    wide=max(1,round(1/max(s,0.05)))
    for i in range(wide): put(x+i-wide//2,y,[b*c for c in col])
    if b>150:
        for dx,dy in ((1,0),(-1,0),(0,1),(0,-1)): put(x+dx,y+dy,[0.35*b*c for c in col])
raw=b''.join(b'\0'+bytes(v for p in px[y*W:(y+1)*W] for v in p) for y in range(H))
def chunk(t,d): return struct.pack('>I',len(d))+t+d+struct.pack('>I',zlib.crc32(t+d))
open('stars.png','wb').write(b'\x89PNG\r\n\x1a\n'+chunk(b'IHDR',struct.pack('>IIBBBBB',W,H,8,2,0,0,0))+chunk(b'IDAT',zlib.compress(raw,9))+chunk(b'IEND',b''))
